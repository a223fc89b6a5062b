// One fragment of a z-field tree (BN12, section 5): iterations for the view ray and the light ray, light, depth and sample
// mask, all from the same last fetch.
#include "physics/light.glsl"
#include "physics/correction.glsl"
#include "physics/masks.glsl"
#include "physics/zfield.glsl"
#include "physics/shadow.glsl"
#include "physics/transfer.glsl"
#include "physics/indirect.glsl"
#include "frame/trees/zfield_light.glsl"

layout(location = 0) in vec4 view_p[3];
layout(location = 3) in vec3 light_p[3];
layout(location = 6) in vec3 shadow_p;
layout(location = 7) flat in vec4 view_c[3];
layout(location = 10) flat in vec4 light_c[3];
layout(location = 13) flat in vec3 light_d[3];
layout(location = 16) flat in vec4 shadow_c;
layout(location = 17) flat in vec4 weights;
layout(location = 18) flat in vec4 optics;
layout(location = 19) flat in vec4 sun;
layout(location = 20) flat in vec4 sky;
layout(location = 21) flat in uvec4 tree_bits;
layout(location = 22) flat in vec4 own; // dither, c of the self-shadow times the root of the phase angle, lit share's correction, sun's change
layout(location = 23) flat in vec4 bark_ratio;
layout(location = 24) flat in vec4 mean_sun;
layout(location = 25) flat in vec4 mean_sky;
layout(location = 27) flat in uvec4 handed;
layout(location = 28) flat in uvec2 handed_sky;
layout(location = 26) flat in vec4 sun_from; // in the tree's own axes; w: strength of light transfer

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 6) uniform sampler2DArray views;
layout(binding = 7) uniform sampler2DArray shadow_map;
layout(binding = 8) uniform sampler2DArray transfer_1;
layout(binding = 9) uniform sampler2DArray transfer_2;
layout(constant_id = 3) const uint SAMPLES = 4u;
layout(constant_id = 4) const uint ESTIMATES = 1u;
layout(constant_id = 7) const bool MAGNIFIED = false;
layout(constant_id = 5) const int LIGHT_ITERATIONS = 1;
layout(constant_id = 6) const bool HAS_SUN = true;
layout(constant_id = 8) const bool CONVERGED = false; // to the average light: nothing of the tree's own is left
layout(constant_id = 9) const uint TRANSFER_BANDS = 0u;
layout(constant_id = 10) const bool INDIRECT = false;
layout(constant_id = 11) const uint TRANSFER_LEVELS = 1u; // by which its texels are larger than the views'

// Returns the species, counted from 1. Sets sample mask and depth. `lit` is the fraction of the sun that arrives.
uint shade(out vec3 sun_part, out vec3 sky_part, out float lit) {
    vec3 p[3], d[3];
    for (int i = 0; i < 3; i++) {
        p[i] = view_p[i].xyz;
        d[i] = view_c[i].xyz - p[i];
    }
    vec3 w = vec3(weights.xy, 1.0 - weights.x - weights.y);
    vec3 layers = vec3(view_c[0].w, view_c[1].w, view_c[2].w);
    bool below = (tree_bits.w >> 4u & 1u) != 0u;
    Surface at = zfield_search(views, p, d, layers, w, optics.x, MAGNIFIED ? 0u : ESTIMATES, MAGNIFIED ? ESTIMATES : 0u, below);
    // Nothing behind the eye is seen: there s would be 1 or more.
    float s = clamp(at.s, -1e3, 0.999);
    float opacity = at.s < 0.999 ? at.opacity * optics.z : 0.0;
    uint covered = covered_samples(opacity, own.x, SAMPLES);
    gl_SampleMask[0] = int(mask_column(tree_bits.xyz, covered, SAMPLES));
    // Reverse Z: depth is near / distance, and the distance shrinks by 1 - s.
    gl_FragDepth = min(gl_FragCoord.z / (1.0 - s), 1.0);

    sun_part = mean_sun.rgb;
    sky_part = mean_sky.rgb;
    lit = HAS_SUN ? mean_sky.w : 0.0;
    uint species = (tree_bits.w >> 5u & 7u) + 1u;
    float height = mix(view_p[0].w, optics.w, s);
    if (CONVERGED && INDIRECT) {
        sun_part += handed_at(handed.xy, height);
        sky_part += handed_at(handed.zw, height);
    }
    if (CONVERGED) return species;
    LightRay ray;
    for (int i = 0; i < 3; i++) {
        ray.from[i] = mix(light_p[i], light_c[i].xyz, s);
        ray.metre[i] = light_d[i];
    }
    ray.layers = vec3(light_c[0].w, light_c[1].w, light_c[2].w);
    ray.weights = vec3(weights.zw, 1.0 - weights.z - weights.w);
    ray.entry = mix(shadow_p, shadow_c.xyz, s);
    ray.deeper = shadow_c.w;
    ray.turn = view.v.cascade_turn[min(tree_bits.w & 15u, MAX_CASCADES - 1u)].xy;
    TreeLight tree = TreeLight(sun.rgb, own.w, sky.rgb, mean_sun.rgb, mean_sky.rgb, mean_sky.w, mean_sun.w,
                               vec2(own.z, unpackHalf2x16(tree_bits.w).y), bark_ratio.rgb, bark_ratio.w, sky.w,
                               sun.w, own.y, optics.y, sun_from.xyz, sun_from.w, tree_bits.w & 15u, tree_bits.w >> 8u & 255u, handed, handed_sky);
    TreeParts parts = tree_light(views, shadow_map, transfer_1, transfer_2, tree, at, p, d, layers, below, optics.x, MAGNIFIED, s,
                                 height, ray, LightQuality(HAS_SUN, INDIRECT, LIGHT_ITERATIONS, TRANSFER_BANDS, float(TRANSFER_LEVELS)));
    sun_part = parts.sun;
    sky_part = parts.sky;
    lit = parts.lit;
    return species;
}
