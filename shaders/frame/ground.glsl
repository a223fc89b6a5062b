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
layout(push_constant) uniform Push { TerrainParameters p; uint cascade; };

#include "frame/cover.glsl"

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
    Cover above = cover();
    float open = 0.5 * (1.0 + n.z) * ground_visibility(above.thickness) *
                 ground_contrast(above.coverage, above.expected, view.v.ground_contrast);
    sky = reflectance * open * view.v.sky_radiance;
}
