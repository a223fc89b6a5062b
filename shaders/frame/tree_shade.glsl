// One fragment of a z-field tree (BN12, section 5): iterations for the view ray and the light ray, light, depth and sample
// mask, all from the same last fetch.
#include "physics/light.glsl"
#include "physics/masks.glsl"
#include "physics/zfield.glsl"
#include "physics/shadow.glsl"
#include "physics/transfer.glsl"

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
layout(location = 22) flat in vec2 own; // dither, c of the self-shadow times the root of the phase angle
layout(location = 23) flat in vec4 bark;
layout(location = 24) flat in vec4 mean_sun;
layout(location = 25) flat in vec4 mean_sky;
layout(location = 26) flat in vec4 sun_from; // in the tree's own axes; w: reach of light transfer

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
    uint species = (tree_bits.w >> 8u) + 1u;
    if (CONVERGED) return species;
    // Under the crown there is only bark; half a metre or so of transition.
    float height = mix(view_p[0].w, optics.w, s);
    vec3 colour = mean_sun.w * mix(bark.rgb, vec3(1.0), smoothstep(bark.w - 0.05, bark.w + 0.05, height));
    if (HAS_SUN) {
        float metres = 0.0;
        if (LIGHT_ITERATIONS > 0) {
            vec3 lp[3], ld[3];
            for (int i = 0; i < 3; i++) {
                lp[i] = mix(light_p[i], light_c[i].xyz, s);
                ld[i] = light_d[i];
            }
            vec3 lw = vec3(weights.zw, 1.0 - weights.z - weights.w);
            vec3 light_layers = vec3(light_c[0].w, light_c[1].w, light_c[2].w);
            // Start on the plane through the centre across the light.
            metres = -dot(lw, vec3(lp[0].z, lp[1].z, lp[2].z)) / dot(lw, vec3(ld[0].z, ld[1].z, ld[2].z));
            vec3 inverse_light = 1.0 / vec3(ld[0].z, ld[1].z, ld[2].z);
            for (int k = 0; k < LIGHT_ITERATIONS; k++) {
                // Unfiltered where a texel is no larger than a pixel.
                if (MAGNIFIED) {
                    metres = zfield_fetch(views, lp, ld, inverse_light, light_layers, lw, optics.x, metres, false, k > 0).s;
                } else {
                    metres = zfield_estimate(views, lp, ld, inverse_light, light_layers, lw, optics.x, metres, false);
                }
            }
            metres = max(metres, 0.0);
        }
        float through = self_shadow(own.y, optics.y, metres);
        vec3 entry = mix(shadow_p, shadow_c.xyz, s);
        entry.z += metres * shadow_c.w;
        uint cascade = tree_bits.w & 15u, layer = min(cascade, MAX_CASCADES - 1u);
        float visible = sun_visibility(shadow_map, entry, vec2(0.0), view.v.cascade_turn[layer].xy, layer);
        through *= cascade < MAX_CASCADES ? visible : 1.0;
        float reached = through;
        // From below, views show the other side.
        if (TRANSFER_BANDS > 0u && !below) {
            vec3 shares = at.shares / max(at.shares.x + at.shares.y + at.shares.z, 1e-6);
            // Half as many texels a side as a view has.
            float mip = max(optics.x - 1.0, 0.0);
            float x = transfer_fetch(transfer_1, transfer_first(sun_from.xyz), p, d, layers, shares, mip, s);
            if (TRANSFER_BANDS > 1u) x += transfer_fetch(transfer_2, transfer_second(sun_from.xyz), p, d, layers, shares, mip, s);
            reached *= max(1.0 + sun_from.w * x, 0.0);
        }
        sun_part += sun.rgb * colour * reached;
        lit += mean_sun.w * through;
    }
    // Depth under the top of the canopy, for the sky through the hole around the tree.
    float below_top = max(1.0 - height, 0.0) * sky.w;
    sky_part += sky.rgb * colour * (at.occlusion / (1.0 + below_top * below_top * sun.w));
    return species;
}
