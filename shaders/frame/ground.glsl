// Light on the ground (BN12, eq. 10-12) and of the forest far away.
#include "physics/light.glsl"
#include "physics/shadow.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec2 slope_at;
layout(location = 2) flat in uint layer;
layout(location = 6) centroid in vec4 tree_sun;
layout(location = 7) centroid in vec4 tree_sky;
layout(location = 8) centroid in vec4 paths;
layout(location = 9) centroid in vec2 vertical;

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 3) uniform sampler2DArray slope_tiles;
layout(binding = 4) uniform sampler2DArray albedo;
layout(binding = 5) uniform sampler2DArray shadow_map;
layout(push_constant) uniform Push { TerrainParameters p; };

#include "forest/expected.glsl"
#include "frame/cover.glsl"
#include "physics/handover.glsl"
layout(constant_id = 5) const bool HAS_SUN = true;
layout(constant_id = 6) const bool SHADOWED = true; // within reach of a cascade

struct GroundLight {
    vec3 sun, sky;  // parts of the radiance
    float trees;    // share of the pixel that is trees of the shader-map
    vec4 fractions; // lit and shadowed ground, lit and shadowed trees
    float coverage; // of the ground by discs of trees, from above
};

// How much of the sun the shadow maps leave.
float shadow_maps(vec3 n, float cosine, float distance) {
    if (!SHADOWED) return 1.0;
    uint c = cascade_at(view.v.cascade_far, view.v.cascade_count, distance);
    if (c == MAX_CASCADES) return 1.0;
    // Ground that curves within a texel would shade itself: half a texel towards the sun, more where the sun grazes.
    float texel = view.v.cascade_texel[c];
    vec3 from = position + n * (texel * sqrt(1.0 - cosine * cosine)) + view.v.sun_direction * (0.5 * texel);
    vec2 gradient = plane_gradient(n, view.v.cascade_x, view.v.cascade_y, view.v.sun_direction);
    vec3 at = (view.v.cascade_from_world[c] * vec4(from, 1.0)).xyz;
    return sun_visibility(shadow_map, at, gradient, view.v.cascade_turn[c].xy, c);
}

// Unit normal of the ground.
vec3 ground_normal() { return normalize(vec3(-textureLod(slope_tiles, vec3(slope_at, float(layer)), 0.0).rg, 1.0)); }

// Ground and, where trees are not drawn one by one, the trees on it (BN12, eq. 11-13 and 24-27).
GroundLight ground_light() {
    vec3 n = ground_normal();
    vec2 world = (vec2(view.v.grid_camera) * p.step + view.v.grid_offset + position.xy) / p.extent;
    vec3 reflectance = textureLod(albedo, vec3(world.x, 1.0 - world.y, 0.0), 0.0).rgb;
    float distance = length(position);
    float cosine = max(dot(n, view.v.sun_direction), 0.0);
    Cover c = cover();
    // What the nodes know per thickness, times the pixel's own.
    float thickness = total_thickness(c.channels);
    float expected = 1.0 - exp(-thickness * vertical.y);
    // Interpolation rounds beyond the values at the vertices.
    float nu = thickness > 0.0 ? clamp(tree_sky.w, 0.0, 1.0) : 0.0, trees_lit = clamp(tree_sun.w, 0.0, 1.0);
    float ground_lit = exp(thickness * min(paths.y - paths.z, 0.0));
    GroundLight g;
    g.coverage = mix(expected, c.channels[0].x, c.resolved);
    float lit = HAS_SUN ? mix(shadow_maps(n, cosine, distance), ground_lit, nu) : 0.0;
    float contrast = mix(ground_contrast(g.coverage, expected, view.v.ground_contrast),
                         ground_contrast(paths.w, expected, view.v.ground_contrast), nu);
    float open = open_ground(thickness * paths.x, paths.x / max(paths.y, 1e-9), g.coverage, expected);
    vec3 sun = reflectance * (cosine * lit / PI) * view.v.sun_irradiance;
    vec3 sky = reflectance * (0.5 * (1.0 + n.z) * exp(-thickness * vertical.x) * contrast) * view.v.sky_radiance;
    g.sun = mix(max(tree_sun.rgb, 0.0), sun, open);
    g.sky = mix(max(tree_sky.rgb, 0.0), sky, open);
    g.trees = 1.0 - open;
    if (cosine <= 0.0) lit = 0.0;
    g.fractions = vec4(open * vec2(lit, 1.0 - lit), (1.0 - open) * vec2(trees_lit, 1.0 - trees_lit));
    return g;
}
