// Evaluates the light on a leaf by its envelope, for tests to compare with src/physics/leaf.rs. A case is 80 floats: thicknesses of 26
// directions, what others leave in each, the normal, the sun, the viewer, and 19 that fill it up.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "physics/leaf.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Cases { float items[]; } cases;
layout(std430, binding = 1) readonly buffer Rule { vec4 items[]; } rule;
layout(std430, binding = 2) writeonly buffer Results { vec4 items[]; } results;
layout(push_constant) uniform Push { uint count; };
layout(constant_id = 0) const uint DIRECTIONS = 26u;
layout(constant_id = 1) const int LEAF_POWER = 6;

void main() {
    uint k = gl_GlobalInvocationID.x, at = 80u * k;
    if (k >= count) return;
    vec3 all[3];
    for (uint i = 0u; i < 3u; i++) all[i] = vec3(cases.items[at + 52u + 3u * i], cases.items[at + 53u + 3u * i], cases.items[at + 54u + 3u * i]);
    LeafLight light = LeafLight(vec2(0.0), 0.0);
    vec2 sides = vec2(0.0);
    float towards = 0.0;
    for (uint j = 0u; j < DIRECTIONS; j++) {
        leaf_direction(light, sides, towards, rule.items[2u * j], rule.items[2u * j + 1u].xyz, cases.items[at + 26u + j], cases.items[at + j],
                       all[0], all[1], LEAF_POWER);
    }
    light = leaf_means(light, sides, towards, all[0]);
    results.items[2u * k] = vec4(light.sky, light.sun, leaf_sun(vec3(0.3), vec3(0.2), all[0], all[2], all[1]).x);
    results.items[2u * k + 1u] = vec4(leaf_sky(vec3(0.3), vec3(0.2), all[0], all[2], light.sky).x, 0.0, 0.0, 0.0);
}
