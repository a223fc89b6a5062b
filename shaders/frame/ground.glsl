// Light on the ground (BN12, eq. 10-12): sun and sky part of its radiance.
#include "physics/light.glsl"
#include "physics/shadow.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec2 slope_at;
layout(location = 2) flat in uint layer;

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 3) uniform sampler2DArray slope_tiles;
layout(binding = 4) uniform sampler2DArray albedo;
layout(binding = 5) uniform usampler2DArray shadow_map;
layout(binding = 6) uniform sampler2DArray coverage;
layout(std430, binding = 7) readonly buffer Pages { uint items[]; } pages;
layout(push_constant) uniform Push { TerrainParameters p; uint cascade; };

// Coverage by trees here, and the expected coverage for the local density: (Gamma, 1 - exp(-Lambda A)), see BN12 eq. 10.
vec2 ground_coverage() {
    vec2 at = (view.v.quad_offset + position.xy) / view.v.quad_side;
    vec2 quad = floor(at);
    ivec2 q = view.v.quad_camera + ivec2(quad);
    // Pages hold the quads around the camera; farther ones would wrap around.
    bool held = all(lessThan(abs(quad), vec2(0.5 * float(GRID_SIDE) - 1.0)));
    uint page = pages.items[(q.x & int(GRID_SIDE - 1u)) + int(GRID_SIDE) * (q.y & int(GRID_SIDE - 1u))];
    if (!held || page == NO_PAGE) return vec2(0.0);
    float side = float(textureSize(coverage, 0).x);
    return textureLod(coverage, vec3(((at - quad) * (side - 1.0) + 0.5) / side, float(page)), 0.0).rg;
}

void ground_light(out vec3 sun, out vec3 sky) {
    vec2 slope = textureLod(slope_tiles, vec3(slope_at, float(layer)), 0.0).rg;
    vec3 n = normalize(vec3(-slope, 1.0));
    vec2 world = (vec2(view.v.grid_camera) * p.step + view.v.grid_offset + position.xy) / p.extent;
    vec3 reflectance = textureLod(albedo, vec3(world.x, 1.0 - world.y, 0.0), 0.0).rgb;
    float distance = length(position), visible = 1.0;
    float cosine = max(dot(n, view.v.sun_direction), 0.0);
    uint c = 0u;
    for (uint k = 0u; k + 1u < view.v.cascade_count; k++) c += distance > view.v.cascade_far[k] ? 1u : 0u;
    if (view.v.cascade_count > 0u && distance <= view.v.cascade_far[view.v.cascade_count - 1u]) {
        // A texel of the map spans ground of differing depth: move the lookup out of the surface by its half diagonal,
        // more where the sun grazes.
        float texel = view.v.cascade_texel[c];
        vec3 from = position + n * (texel * 1.5 * sqrt(1.0 - cosine * cosine)) + view.v.sun_direction * (0.5 * texel);
        visible = sun_visibility(shadow_map, (view.v.cascade_from_world[c] * vec4(from, 1.0)).xyz, c);
        // Shadows end smoothly, not at a line.
        visible = mix(visible, 1.0, smoothstep(0.8, 1.0, distance / view.v.cascade_far[view.v.cascade_count - 1u]));
    }
    sun = reflectance * (cosine * visible / PI) * view.v.sun_irradiance;
    // And so do the trees above.
    vec2 cover = ground_coverage() * (1.0 - smoothstep(0.8, 1.0, distance / view.v.range));
    // Lambda A from 1 - exp(-Lambda A); eight bits tell up to 5.5.
    float thickness = -log(max(1.0 - cover.y, 1.0 / 256.0));
    float open = 0.5 * (1.0 + n.z) * ground_visibility(thickness) *
                 ground_contrast(cover.x, cover.y, view.v.ground_contrast);
    sky = reflectance * open * view.v.sky_radiance;
}
