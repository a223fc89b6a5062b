// Evaluates one pure function of shaders/physics on an array of inputs: tests compare with src/physics.
// Words are bits: floats go through uintBitsToFloat, so that integers pass unharmed.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/views.glsl"
#include "physics/light.glsl"
#include "physics/masks.glsl"
#include "physics/shadow.glsl"
#include "physics/tonemap.glsl"
#include "physics/handover.glsl"
#include "physics/tables.glsl"
#include "physics/transfer.glsl"
#include "physics/harmonics.glsl"
#include "physics/correction.glsl"

struct Arguments {
    uvec4 a;
    uvec4 b;
    uvec4 c;
};
struct Result {
    uvec4 a;
    uvec4 b;
};

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Inputs { Arguments items[]; } inputs;
layout(std430, binding = 1) writeonly buffer Results { Result items[]; } results;
layout(push_constant) uniform Push { uint count; };
layout(constant_id = 0) const uint FUNCTION = 0u;

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= count) return;
    Arguments i = inputs.items[k];
    vec4 a = uintBitsToFloat(i.a), b = uintBitsToFloat(i.b), c = uintBitsToFloat(i.c);
    Result r = Result(uvec4(0u), uvec4(0u));
    switch (FUNCTION) {
        case 0u: r.a = uvec4(hash(i.a.x), hash2(i.a.x, i.a.y), floatBitsToUint(unit(i.a.x)), 0u); break;
        case 1u: {
            uvec3 layers;
            vec3 weights;
            view_lookup(a.xyz, int(i.a.w), layers, weights);
            r.a.xyz = layers;
            r.b.xyz = floatBitsToUint(weights);
            break;
        }
        case 2u: r.a.xy = floatBitsToUint(vec2(angle_between(a.xyz, b.xyz), hotspot(a.xyz, b.xyz, c.x, c.y))); break;
        case 3u: r.a.xyz = floatBitsToUint(leaf_phase(a.xyz, b.xyz, vec3(c.x, a.w, c.z), vec3(c.y, b.w, c.w))); break;
        case 4u: r.a.x = floatBitsToUint(hole_occlusion(a.x, a.y)); break;
        case 5u: r.a.x = floatBitsToUint(ground_contrast(a.x, a.y, a.z)); break;
        case 6u: r.a.x = covered_samples(a.x, a.y, i.a.z); break;
        case 7u: r.a.x = mask_column(i.a.xyz, i.b.x, i.b.y); break;
        case 17u: r.a.xy = uvec2(mesh_mask(i.a.y, i.a.z, i.a.w), rest_mask(i.a.x, i.a.y, i.a.z, i.a.w)); break;
        case 8u: {
            vec2 gradient = plane_gradient(a.xyz, b.xyz, c.xyz, vec3(a.w, b.w, c.w));
            r.a.xy = floatBitsToUint(gradient);
            break;
        }
        case 9u: r.a.xyz = floatBitsToUint(tone_curve(a.xyz)); break;
        case 10u: r.a.xyz = floatBitsToUint(srgb(a.xyz)); break;
        case 11u: r.a.x = view_layer(int(i.a.x), int(i.a.y), int(i.a.z)); break;
        case 12u: {
            float open = open_ground(b.x, b.y, b.z, b.w);
            r.a = floatBitsToUint(vec4(converged(a.x, a.y), handed_over(a.x), tree_fade(a.x, a.z), open));
            break;
        }
        case 13u: {
            TableAngles t = table_angles(a.xyz, b.xyz, c.xyz, a.w);
            r.a = floatBitsToUint(vec4(t.v, t.l, t.phi, t.sec_v));
            r.b = floatBitsToUint(vec4(t.sec_l, t.length_v, t.length_l, sun_facing(b.xyz, c.xyz)));
            break;
        }
        case 14u: {
            vec3 at = table_coordinates(TableAngles(a.x, a.y, a.z, 1.0, 1.0, 1.0, 1.0), a.w);
            r.a = floatBitsToUint(vec4(at, table_density(b.x, b.y, b.z)));
            break;
        }
        // As frame/trees/zfield.vert and frame/trees/zfield_shade.glsl share it between them.
        case 15u: r.a.x = floatBitsToUint(self_shadow(a.z * sqrt(a.x), a.w * a.x, a.y)); break;
        case 16u: {
            float x = dot(transfer_decode(a), transfer_first(c.xyz)) + dot(transfer_decode(b), transfer_second(c.xyz));
            r.a.x = floatBitsToUint(max(1.0 + transfer_strength(sqrt(c.w)) * x, 0.0));
            break;
        }
        // Eight of sixteen.
        case 18u: {
            float first[9], third[7], all[16];
            harmonics(a.xyz, first);
            harmonics_third(a.xyz, third);
            for (int n = 0; n < 16; n++) all[n] = n < 9 ? first[n] : third[n - 9];
            uint at = i.a.w;
            r.a = floatBitsToUint(vec4(all[at], all[at + 1u], all[at + 2u], all[at + 3u]));
            r.b = floatBitsToUint(vec4(all[at + 4u], all[at + 5u], all[at + 6u], all[at + 7u]));
            break;
        }
        case 19u: {
            CorrectionTerms y = phase_terms(a.x, a.y, a.z);
            r.a = floatBitsToUint(y.first);
            r.b = floatBitsToUint(y.second);
            break;
        }
    }
    results.items[k] = r;
}
