// Points of the ground that a picture shows, and what trees cover there of it.
layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 3) uniform sampler2DArray slope_tiles;
layout(push_constant) uniform Push { TerrainParameters p; };

#include "forest/expected.glsl"
#include "forest/wind.glsl"
#include "frame/cover.glsl"
#include "physics/lift.glsl"

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
    if (WIND) {
        // Crowns that gusts have moved to where the ray is stand as much behind.
        vec2 sway = view.v.wind.z * gusts_at(view.v.wind.xy, view.v.wind_here.xyz, from.position.xy) * view.v.wind.xy;
        middle -= 0.5 * (low + high) * sway;
        way -= 0.5 * (high - low) * sway;
    }
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
