// Light on the ground (BN12, eq. 10-12) and of the forest far away.
#include "physics/light.glsl"
#include "physics/shadow.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 3) uniform sampler2DArray slope_tiles;
layout(binding = 4) uniform sampler2DArray albedo;
layout(binding = 5) uniform sampler2DArray shadow_map;
layout(push_constant) uniform Push { TerrainParameters p; };

#include "forest/expected.glsl"
#include "frame/cover.glsl"
#include "physics/handover.glsl"
#include "physics/lift.glsl"
layout(constant_id = 5) const bool HAS_SUN = true;
layout(constant_id = 6) const bool SHADOWED = true; // within reach of a cascade

// A point of the ground in the picture.
struct GroundPoint {
    vec3 position;      // from the camera, m
    vec2 slope_at;      // texture coordinates in the quad's tile of slopes
    uint layer;         // of that tile
    CoverPoint cover;
    vec4 tree_sun;      // radiance of the shader-map's trees from the sun; w: their lit fraction
    vec4 tree_sky;      // from the sky; w: nu
    vec4 paths;         // over, seen, joint; w: coverage where ground is seen
    vec4 vertical;      // sky, gap; middle and half depth of crowns
};

struct GroundLight {
    vec3 sun, sky;  // parts of the radiance
    float trees;    // share of the pixel that is trees of the shader-map
    vec4 fractions; // lit and shadowed ground, lit and shadowed trees
    float coverage; // of the ground by discs of trees, from above
};

// How much of the sun the shadow maps leave.
float shadow_maps(vec3 position, vec3 n, float cosine, float distance) {
    if (!SHADOWED) return 1.0;
    uint c = cascade_at(view.v.cascade_far, view.v.cascade_count, distance);
    if (c == MAX_CASCADES) return 1.0;
    // Ground that curves within a texel would shade itself: half a texel towards the sun, more where the sun grazes.
    float texel = view.v.cascade_texel[c];
    vec3 from = position + n * (texel * sqrt(1.0 - cosine * cosine)) + view.v.sun_direction * (0.5 * texel);
    vec2 gradient = plane_gradient(n, view.v.cascade_x, view.v.cascade_y, view.v.sun_direction);
    vec3 at = (view.v.cascade_from_world[c] * vec4(from, 1.0)).xyz;
    return sun_visibility(shadow_map, at, gradient, view.v.cascade_turn[c].xy, c, NO_TREE, 0.0);
}

// Unit normal of the ground.
vec3 ground_normal(vec2 slope_at, uint layer) {
    return normalize(vec3(-textureLod(slope_tiles, vec3(slope_at, float(layer)), 0.0).rg, 1.0));
}

// A place some metres from that of a point, on the map; n is the ground's normal there. Whoever includes this defines it.
CoverPoint moved(GroundPoint from, vec2 by, vec3 n);

// What trees cover of the ground under a ray while it is from `low` to `high` above where it would be on it; nothing where it is not asked
// for. (A loop, because drivers on CPUs run what an `if` leaves out.)
Cover cover_under(GroundPoint from, vec3 ray, vec3 n, float low, float high, bool asked) {
    vec2 middle = lifted(ray, n, 0.5 * (low + high)), way = lifted(ray, n, 0.5 * (high - low));
    float span = 2.0 * from.cover.scale * length(way);
    uint count = lift_count(span * float(COVER_SIDE) / cover_texel(from.cover));
    // Of the rest, the mean: no texel finer than a part of the way.
    from.cover = coarsened(from.cover, span / float(count));
    Cover c;
    c.texel = c.resolved = 0.0;
    for (uint g = 0u; g < COVER_GROUPS; g++) c.channels[g] = vec4(0.0);
    for (uint k = 0u; k < (asked ? count : 0u); k++) {
        Cover next = cover(moved(from, middle + way * lift_height(k, count), n));
        c.texel = next.texel;
        c.resolved = next.resolved;
        for (uint g = 0u; g < COVER_GROUPS; g++) c.channels[g] += next.channels[g] / float(count);
    }
    return c;
}

// Thickness of what shades a point: read once, in the mean over where the sun's rays are among the crowns, in the quad's own tile.
float thickness_towards_sun(GroundPoint from, vec3 n) {
    vec2 way = lifted(view.v.sun_direction, n, 2.0 * from.vertical.w);
    CoverPoint c = coarsened(from.cover, from.cover.scale * length(way));
    c.at.xy += c.scale * lifted(view.v.sun_direction, n, from.vertical.z);
    return total_thickness(cover(c).channels);
}

// Ground and, where trees are not drawn one by one, the trees on it (BN12, eq. 11-13 and 24-27).
GroundLight ground_light(GroundPoint at, vec3 n) {
    vec2 world = (vec2(view.v.grid_camera) * p.step + view.v.grid_offset + at.position.xy) / p.extent;
    vec3 reflectance = textureLod(albedo, vec3(world.x, 1.0 - world.y, 0.0), 0.0).rgb;
    float distance = length(at.position);
    float cosine = max(dot(n, view.v.sun_direction), 0.0);
    vec3 v = at.position * (-1.0 / max(distance, 1e-6));
    float low = at.vertical.z - at.vertical.w, high = at.vertical.z + at.vertical.w; // where crowns begin and end
    // Trees that are drawn one by one hide by themselves.
    Cover c = cover(at.cover), between = cover_under(at, v, n, low, high, at.paths.x > 0.0);
    float here = total_thickness(c.channels), thickness = total_thickness(between.channels), shading = here;
    if (HAS_SUN && at.tree_sky.w > 0.0) shading = thickness_towards_sun(at, n);
    // What the nodes know per thickness, times the pixel's own.
    float expected = 1.0 - exp(-thickness * at.vertical.y);
    // Interpolation rounds beyond the values at the vertices.
    float nu = here + shading > 0.0 ? clamp(at.tree_sky.w, 0.0, 1.0) : 0.0, trees_lit = clamp(at.tree_sun.w, 0.0, 1.0);
    float ground_lit = exp(shading * min(at.paths.y - at.paths.z, 0.0));
    GroundLight g;
    g.coverage = mix(1.0 - exp(-here * at.vertical.y), c.channels[0].x, c.resolved);
    float crowns = mix(expected, between.channels[0].x, between.resolved);
    float lit = HAS_SUN ? mix(shadow_maps(at.position, n, cosine, distance), ground_lit, nu) : 0.0;
    // Around the mean of the ground that is seen, so that light is the same at every distance.
    float contrast = mix(ground_contrast(g.coverage, at.paths.w, view.v.ground_contrast), 1.0, nu);
    float open = open_ground(thickness * at.paths.x, at.paths.x / max(at.paths.y, 1e-9), crowns, expected);
    vec3 sun = reflectance * (cosine * lit / PI) * view.v.sun_irradiance;
    vec3 sky = reflectance * (ground_sky(n.z, exp(-here * at.vertical.x), here) * contrast) * view.v.sky_radiance;
    g.sun = mix(max(at.tree_sun.rgb, 0.0), sun, open);
    g.sky = mix(max(at.tree_sky.rgb, 0.0), sky, open);
    g.trees = 1.0 - open;
    if (cosine <= 0.0) lit = 0.0;
    g.fractions = vec4(open * vec2(lit, 1.0 - lit), (1.0 - open) * vec2(trees_lit, 1.0 - trees_lit));
    return g;
}
