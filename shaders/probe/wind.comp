// Evaluates what the wind does to trees, for tests to compare with src/physics/wind.rs. A case is 16 words: direction, amplitudes by gusts, of its own, of
// branches and of leaves, clock, three phases, place or vector of three, height, hash, and a shear's word.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "physics/wind.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Cases { uint items[]; } cases;
layout(std430, binding = 1) writeonly buffer Results { vec4 items[]; } results;
layout(push_constant) uniform Push { uint count; };

float number(uint k, uint i) { return uintBitsToFloat(cases.items[16u * k + i]); }

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= count) return;
    Motion m = Motion(vec2(number(k, 0u), number(k, 1u)), number(k, 2u), number(k, 3u), number(k, 4u), number(k, 5u), cases.items[16u * k + 6u]);
    vec3 phases = vec3(number(k, 7u), number(k, 8u), number(k, 9u)), p = vec3(number(k, 10u), number(k, 11u), number(k, 12u));
    uint hash = cases.items[16u * k + 14u], word = cases.items[16u * k + 15u];
    float gusts = gusts_at(m.toward, phases, p.xy);
    vec2 sway = tree_sway(m, gusts, number(k, 13u), hash);
    vec3 axis = card_axis(word >> 16u);
    results.items[4u * k] = vec4(gusts, sway, leaf_flutter(m, hash));
    results.items[4u * k + 1u] = vec4(branch_sway(m, p, hash & 255u), uintBitsToFloat(pack_sway(sway)));
    results.items[4u * k + 2u] = vec4(turned_about(p, axis, leaf_flutter(m, hash)), dot(place_turns(word), vec3(1.0)));
    results.items[4u * k + 3u] = vec4(unpack_sway(word), axis.xy);
}
