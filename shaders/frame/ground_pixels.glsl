// The ground as the picture's samples see it: which quad, how deep, and the point that a pixel shows.
#include "frame/ground_point.glsl"
#include "frame/quad.glsl"
#include "frame/camera.glsl"
#include "frame/samples.glsl"
#include "frame/tile.glsl"
#include "frame/forest_node.glsl"
#include "frame/shown.glsl"
#include "frame/surfaces_seen.glsl"

layout(binding = 1) uniform usamplerBuffer quads;   // of three texels
layout(binding = 7) uniform samplerBuffer nodes;    // of four texels
layout(constant_id = 2) const uint SAMPLES = 4u;
layout(constant_id = 4) const bool SKY_DRAWN = false; // in the picture already, as if all samples saw it

// The quad of the ground that a sample sees, counted from 1; 0 where it sees the sky, or a mesh or card before either.
uint ground_quad(ivec2 pixel, int k) {
    uint surface = surface_seen(pixel, k);
    return is_ground(surface) ? surface : 0u;
}

ForestNode fetch_node(uint quad, ivec2 node) {
    int at = (int(quad * FOREST_NODES * FOREST_NODES) + node.y * int(FOREST_NODES) + node.x) * 4;
    vec4 a = texelFetch(nodes, at), b = texelFetch(nodes, at + 1), c = texelFetch(nodes, at + 2), d = texelFetch(nodes, at + 3);
    return ForestNode(a.xyz, a.w, b.xyz, b.w, c.x, c.y, c.z, c.w, d.x, d.y, d.z, d.w);
}

// Where in its square of ground, in [0, 1], a quad has a position from the camera, and how far it has morphed there.
vec3 place_of(TerrainQuad q, vec3 position) {
    return vec3(quad_place(q, view.v, position.xy, p.step), smoothstep(q.morph.x, q.morph.y, length(position)));
}

// The same in its coverage tile; `spans` are the metres that a pixel does along its longer side.
CoverPoint cover_point(TerrainQuad q, vec3 place, float spans) {
    float scale = q.cover_scale / (p.step * float(q.spacing) * float(TERRAIN_CELLS));
    return CoverPoint(vec3(q.cover_offset + q.cover_scale * place.xy, q.cover_floor * place.z), scale, q.cover_disc, q.cover_layer,
                      spans + log2(scale));
}

bool in_tile(CoverPoint c) { return all(equal(c.at.xy, clamp(c.at.xy, 0.0, 1.0))); }

// Beyond the border of the point's tile it is in that of the quad that is seen there, if any is; else as on the border.
CoverPoint moved(GroundPoint from, vec2 by, vec3 n) {
    CoverPoint c = from.cover;
    c.at.xy += c.scale * by;
    // A loop, as in cover_under.
    for (bool outside = !in_tile(c); outside; outside = false) {
        vec2 size = vec2(picture_size());
        Camera camera = camera_of(view.v, size);
        vec3 position = from.position + vec3(by, -dot(n.xy, by) / n.z);
        float distance = dot(position, camera.forward);
        ivec2 pixel = ivec2(floor(0.5 * size + vec2(dot(position, camera.x), dot(position, camera.y)) / distance));
        if (distance <= 0.0 || any(notEqual(pixel, clamp(pixel, ivec2(0), ivec2(size) - 1)))) break;
        uint other = ground_quad(pixel, 0);
        if (other == 0u) break;
        TerrainQuad q = fetch_quad(quads, other - 1u);
        CoverPoint there = cover_point(q, place_of(q, position), from.cover.footprint - log2(from.cover.scale));
        if (in_tile(there)) c = there;
    }
    return c;
}

// A point of a quad's ground; `ray` goes through it, with 1 along the camera's axis, and `distance` is its own along that.
GroundPoint point_of(uint index, vec3 position, vec3 ray, float distance, Camera camera, out vec3 n) {
    TerrainQuad q = fetch_quad(quads, index);
    float cell = float(q.spacing);
    // Cells from the quad's corner. The last before the end of the terrain is narrower than the others, of the same slopes.
    vec3 place = place_of(q, position);
    vec2 at = place.xy * float(TERRAIN_CELLS);
    vec2 whole = clamp(floor(at), vec2(0.0), vec2(float(TERRAIN_CELLS - 1u)));
    vec2 width = max(min((p.last - vec2(q.corner)) / cell - whole, 1.0), 1e-3);
    vec2 within = (whole + clamp((at - whole) / width, 0.0, 1.0)) / float(TERRAIN_CELLS);
    GroundPoint g;
    g.position = position;
    g.slope_at = (within * float(TERRAIN_SLOPES - 1u) + 0.5) / float(TERRAIN_SLOPES);
    g.layer = q.layer;
    n = ground_normal(g.slope_at, g.layer);
    // Where the neighbouring pixels' rays meet the plane through the point: no more grazing than a hundredth of a pixel's slope.
    float facing = max(-dot(n, ray), 1e-4);
    vec3 right = camera.right + ray * (dot(n, camera.right) / facing), down = camera.down + ray * (dot(n, camera.down) / facing);
    g.cover = cover_point(q, place, cover_footprint(right.xy * distance, down.xy * distance));
    g.tree_sun = g.tree_sky = g.paths = vec4(0.0);
    g.vertical = vec4(0.0);
    if (COVER_CHANNELS > 0u) {
        vec2 node = clamp(within, 0.0, 1.0) * float(FOREST_NODES - 1u);
        ivec2 low = ivec2(min(floor(node), float(FOREST_NODES - 2u)));
        vec2 f = node - vec2(low);
        ForestNode m = mix_nodes(mix_nodes(fetch_node(index, low), fetch_node(index, low + ivec2(1, 0)), f.x),
                                 mix_nodes(fetch_node(index, low + ivec2(0, 1)), fetch_node(index, low + 1), f.x), f.y);
        g.tree_sun = vec4(m.tree_sun, m.tree_lit);
        g.tree_sky = vec4(m.tree_sky, m.converged);
        g.paths = vec4(m.over, m.seen, m.joint, m.seen_coverage);
        g.vertical = vec4(m.sky, m.gap, m.middle, m.half_depth);
    }
    return g;
}

// What a pixel's samples see of the ground: the mean of what they do of the first one's quad. `seen` are they.
GroundPoint point_at(ivec2 pixel, uint seen, vec2 size, Camera camera, out vec3 n) {
    uint quad = 0u;
    vec3 sum = vec3(0.0);
    float count = 0.0;
    for (uint k = 0u; k < SAMPLES; k++) {
        uint other = ground_quad(pixel, int(k));
        bool counts = (seen >> k & 1u) != 0u && (quad == 0u || other == quad);
        vec2 offset = vec2(pixel) + 0.5 + sample_offset(k, SAMPLES) - 0.5 * size;
        float depth = view.v.clip_from_world[3].z / surface_depth(pixel, int(k));
        quad = counts ? other : quad;
        sum += counts ? depth * ray_through(camera, offset) : vec3(0.0);
        count += counts ? 1.0 : 0.0;
    }
    vec3 position = sum / count;
    float distance = dot(position, camera.forward);
    return point_of(quad - 1u, position, position / distance, distance, camera, n);
}

// Samples that the ground covers, whatever is before it.
uint ground_samples(ivec2 pixel) {
    uint samples = 0u;
    for (uint k = 0u; k < SAMPLES; k++) samples |= ground_quad(pixel, int(k)) != 0u ? 1u << k : 0u;
    return samples;
}

Shown sky_at(ivec2 pixel) {
    if (SKY_DRAWN) return load_pixel(pixel);
    return shown_sky(view.v.sky_radiance);
}
