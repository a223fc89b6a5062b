// Light on the ground where samples see it, once a pixel, and the sky behind, before which trees stand where the ground ends. One workgroup
// a tile of 8 x 8 pixels: every invocation lists the pixels of its column that see ground or its end; then all shade the list in turn.
#include "frame/ground.glsl"
#include "frame/camera.glsl"
#include "frame/samples.glsl"
#include "frame/tile.glsl"
#include "frame/forest_node.glsl"
#include "frame/view_mode.glsl"
#include "frame/ground_mode.glsl"
#include "frame/shown.glsl"
#include "frame/column_items.glsl"

layout(local_size_x = 8) in;
layout(binding = 1) uniform usamplerBuffer quads;   // of three texels
layout(binding = 7) uniform samplerBuffer nodes;    // of four texels
layout(binding = 8) uniform usamplerBuffer trees_seen; // counted from 1, a sample
layout(constant_id = 2) const uint SAMPLES = 4u;
layout(constant_id = 3) const bool TREES = true;    // some are drawn before the ground
layout(constant_id = 4) const bool SKY_IMAGE = false; // and in the picture already, as if all samples saw it

TerrainQuad fetch_quad(uint quad) {
    int at = int(quad) * 3;
    uvec4 a = texelFetch(quads, at), b = texelFetch(quads, at + 1), c = texelFetch(quads, at + 2);
    return TerrainQuad(ivec2(a.xy), int(a.z), a.w, uintBitsToFloat(b.xy), uintBitsToFloat(b.zw), uintBitsToFloat(c.x), c.y,
                       uintBitsToFloat(c.z), uintBitsToFloat(c.w));
}

ForestNode fetch_node(uint quad, ivec2 node) {
    int at = (int(quad * FOREST_NODES * FOREST_NODES) + node.y * int(FOREST_NODES) + node.x) * 4;
    vec4 a = texelFetch(nodes, at), b = texelFetch(nodes, at + 1), c = texelFetch(nodes, at + 2), d = texelFetch(nodes, at + 3);
    return ForestNode(a.xyz, a.w, b.xyz, b.w, c.x, c.y, c.z, c.w, d.x, d.y, d.z, d.w);
}

// Where in its square of ground, in [0, 1], a quad has a position from the camera, and how far it has morphed there.
vec3 place_of(TerrainQuad q, vec3 position) {
    vec2 cells = (vec2(view.v.grid_camera - q.corner) + (position.xy + view.v.grid_offset) / p.step) / float(q.spacing);
    return vec3(cells / float(TERRAIN_CELLS), smoothstep(q.morph.x, q.morph.y, length(position)));
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
        TerrainQuad q = fetch_quad(other - 1u);
        CoverPoint there = cover_point(q, place_of(q, position), from.cover.footprint - log2(from.cover.scale));
        if (in_tile(there)) c = there;
    }
    return c;
}

// A point of a quad's ground; `ray` goes through it, with 1 along the camera's axis, and `distance` is its own along that.
GroundPoint point_of(uint index, vec3 position, vec3 ray, float distance, Camera camera, out vec3 n) {
    TerrainQuad q = fetch_quad(index);
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
        float depth = view.v.clip_from_world[3].z / ground_depth(pixel, int(k));
        quad = counts ? other : quad;
        sum += counts ? depth * (camera.forward + offset.x * camera.right + offset.y * camera.down) : vec3(0.0);
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

const uint EDGE_ROWS = 6u; // how far trees that are not drawn one by one stand out from where the ground ends, pixels
const bool EDGES = COVER_CHANNELS > 0u;

// How many rows below a pixel of the sky the ground ends, or more than EDGE_ROWS. Trees that stand out there are drawn one by one where
// ridges are looked for.
uint edge_below(ivec2 pixel, ivec2 size) {
    if (!EDGES || VIEW_MODE != 0u || view.v.silhouette_ratio > 1.0) return EDGE_ROWS + 1u;
    // Under most of the sky there is more of it.
    ivec2 last = ivec2(pixel.x, min(pixel.y + int(EDGE_ROWS), size.y - 1));
    uint row = ground_quad(last, 0) != 0u ? 0u : EDGE_ROWS + 1u;
    while (row <= EDGE_ROWS && (pixel.y + int(row) >= size.y || ground_samples(pixel + ivec2(0, row)) == 0u)) row++;
    return row;
}

Shown sky_at(ivec2 pixel) {
    if (SKY_IMAGE) return load_pixel(pixel);
    return shown_sky(view.v.sky_radiance);
}

// The highest of a pixel's samples of the ground.
uint highest(uint samples) {
    uint found = samples & -samples;
    for (uint k = 0u; k < SAMPLES; k++) {
        bool higher = sample_offset(k, SAMPLES).y < sample_offset(findLSB(found), SAMPLES).y;
        if ((samples >> k & 1u) != 0u && higher) found = 1u << k;
    }
    return found;
}

// Share of what a sight line along `ray` sees that are trees, above the ground's end at a point of normal n.
float standing_out(GroundPoint at, vec3 n, vec3 ray, float distance) {
    float above = max(dot(ray * distance - at.position, n) / n.z, 0.0);
    float low = max(at.vertical.z - at.vertical.w - above, 0.0), high = at.vertical.z + at.vertical.w - above;
    if (high <= low) return 0.0;
    float thickness = total_thickness(cover_under(at, -normalize(ray), n, low, high, true).channels);
    return 1.0 - exp(-thickness * at.paths.x * (high - low) / (2.0 * at.vertical.w));
}

// Those trees before the sky that samples `seen` see, as many rows above the ground's end.
Shown standing_before(Shown sky, ivec2 pixel, uint row, uint seen, ivec2 size) {
    Camera camera = camera_of(view.v, vec2(size));
    ivec2 edge = pixel + ivec2(0, row);
    vec3 n;
    GroundPoint at = point_at(edge, highest(ground_samples(edge)), vec2(size), camera, n);
    float distance = dot(at.position, camera.forward), trees = 0.0;
    for (uint k = 0u; k < SAMPLES; k++) {
        if ((seen >> k & 1u) == 0u) continue;
        vec2 offset = vec2(pixel) + 0.5 + sample_offset(k, SAMPLES) - 0.5 * vec2(size);
        trees += standing_out(at, n, camera.forward + offset.x * camera.right + offset.y * camera.down, distance);
    }
    trees /= float(bitCount(seen));
    vec3 sun = trees * max(at.tree_sun.rgb, 0.0), from_sky = trees * max(at.tree_sky.rgb, 0.0);
#ifdef LAYERS
    float lit = clamp(at.tree_sun.w, 0.0, 1.0);
    return sum(scaled(sky, 1.0 - trees), Shown(vec4(sun, trees), vec4(from_sky, trees), vec4(0.0, 0.0, trees * vec2(lit, 1.0 - lit))));
#else
    return sum(scaled(sky, 1.0 - trees), Shown(vec4(sun + from_sky, trees)));
#endif
}

// The sky that samples `seen` see, and the trees before it that stand where the ground ends, some rows below.
Shown sky_beyond(ivec2 pixel, uint seen, ivec2 size) {
    Shown shown = sky_at(pixel);
    uint row = edge_below(pixel, size);
    // A loop, as in cover_under.
    for (bool edge = row <= EDGE_ROWS; edge; edge = false) shown = standing_before(shown, pixel, row, seen, size);
    return shown;
}

shared uint items[8u * TILE_SIDE]; // pixels of each column to shade: its row | samples of the ground << 8 | of the sky << 16

// Lists the pixels of this invocation's column that see ground, or sky where it ends. Where others see the sky, that is all that they do.
void list_pixels(uvec2 corner, uint column, uvec2 size) {
    uint count = 0u;
    for (uint row = 0u; row < TILE_SIDE; row++) {
        uvec2 pixel = min(corner + uvec2(column, row), size - 1u);
        bool inside = pixel == corner + uvec2(column, row);
        int at = int((pixel.y * size.x + pixel.x) * SAMPLES);
        uint open = (1u << SAMPLES) - 1u, samples = ground_samples(ivec2(pixel));
        for (uint k = 0u; k < SAMPLES; k++) {
            if (TREES) open &= texelFetch(trees_seen, at + int(k)).x != 0u ? ~(1u << k) : ~0u;
        }
        uint sky = open & ~samples;
        bool edge = sky != 0u && edge_below(ivec2(pixel), ivec2(size)) <= EDGE_ROWS;
        samples &= open;
        if (inside && (samples != 0u || edge)) {
            items[column * TILE_SIDE + count] = row | samples << 8u | sky << 16u;
            count++;
        }
        if (inside && samples == 0u && !edge && open != 0u && (!SKY_IMAGE || open + 1u != 1u << SAMPLES)) {
            store_pixel(ivec2(pixel), scaled(sky_at(ivec2(pixel)), float(bitCount(open)) / float(SAMPLES)));
        }
        if (inside && (open & 1u) != 0u) store_first(ivec2(pixel), 0u, ground_depth(ivec2(pixel), 0));
    }
    counts[column] = count;
}

// The ground that a pixel's samples see; `seen` are they.
Shown ground_at(ivec2 pixel, uint seen, vec2 size) {
    vec3 n;
    GroundPoint at = point_at(pixel, seen, size, camera_of(view.v, size), n);
    GroundLight g = ground_light(at, n);
#ifdef LAYERS
    return Shown(vec4(g.sun, 1.0), vec4(g.sky, g.trees), g.fractions);
#else
    if (VIEW_MODE != 0u) return Shown(vec4(ground_mode(at, g, n), 1.0));
    return Shown(vec4(g.sun + g.sky, 1.0));
#endif
}

void main() {
    uvec2 size = picture_size(), corner = tile_corner();
    uint column = gl_LocalInvocationIndex;
    list_pixels(corner, column, size);
    barrier();
    uint total = item_count();
    for (uint i = column; i < total; i += 8u) {
        uint slot = item_slot(i, TILE_SIDE), found = items[slot];
        ivec2 pixel = ivec2(corner + uvec2(slot / TILE_SIDE, found & 0xffu));
        uint seen = found >> 8u & 0xffu, sky = found >> 16u;
        float part = 1.0 / float(SAMPLES);
        Shown shown = shown_nothing();
        // Loops, as in cover_under.
        for (bool ground = seen != 0u; ground; ground = false) {
            shown = scaled(ground_at(pixel, seen, vec2(size)), part * float(bitCount(seen)));
        }
        for (bool open = sky != 0u; open; open = false) {
            shown = sum(shown, scaled(sky_beyond(pixel, sky, ivec2(size)), part * float(bitCount(sky))));
        }
        store_pixel(pixel, shown);
    }
}
