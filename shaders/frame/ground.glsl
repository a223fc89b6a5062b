// Light on the ground (BN12, eq. 10-12) and of the forest far away.
// Whoever includes this has included frame/ground_point.glsl.
#include "physics/light.glsl"
#include "physics/shadow.glsl"
#include "physics/handover.glsl"
#include "physics/indirect.glsl"

layout(binding = 4) uniform sampler2DArray albedo;
layout(binding = 5) uniform sampler2DArray shadow_map;
layout(binding = 9) uniform samplerBuffer indirect;
layout(constant_id = 7) const bool INDIRECT = false;
layout(constant_id = 8) const int INDIRECT_NODES = 2; // of the density
layout(constant_id = 5) const bool HAS_SUN = true;
layout(constant_id = 6) const bool SHADOWED = true; // within reach of a cascade

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
    float mapped = HAS_SUN ? clamp(4.0 * at.tree_sky.w - 1.0, 0.0, 1.0) : 0.0; // near, shadow maps know better
    for (bool far = mapped > 0.0; far; far = false) shading = mix(here, thickness_towards_sun(at, n), mapped);
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
    if (INDIRECT) {
        IndirectAt between_nodes = indirect_at(here, texelFetch(indirect, 0).w, INDIRECT_NODES);
        sky += reflectance * indirect_ground_sky(indirect, between_nodes) * view.v.sky_radiance;
        if (HAS_SUN) {
            sun += (reflectance * sun_facing(view.v.sun_direction, n)) * indirect_ground_sun(indirect, between_nodes, view.v.sun_direction.z) * view.v.sun_irradiance;
        }
    }
    g.sun = mix(max(at.tree_sun.rgb, 0.0), sun, open);
    g.sky = mix(max(at.tree_sky.rgb, 0.0), sky, open);
    g.trees = 1.0 - open;
    if (cosine <= 0.0) lit = 0.0;
    g.fractions = vec4(open * vec2(lit, 1.0 - lit), (1.0 - open) * vec2(trees_lit, 1.0 - trees_lit));
    return g;
}
