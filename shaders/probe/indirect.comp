// Evaluates light that met more than one surface, for tests to compare with src/physics/indirect.rs. A case is thickness, the cosines of viewer
// and sun and of the angle between them, height, and three that fill it up.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "physics/indirect.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Cases { vec4 items[]; } cases;
layout(std430, binding = 1) writeonly buffer Results { vec4 items[]; } results;
layout(binding = 2) uniform samplerBuffer nodes;
layout(push_constant) uniform Push { uint count; };
layout(constant_id = 0) const int NODES = 8;

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= count) return;
    vec4 c = cases.items[2u * k];
    float z = cases.items[2u * k + 1u].x;
    int base = NODES * INDIRECT_GROUND;
    IndirectAt at = indirect_at(c.x, texelFetch(nodes, 0).w, NODES);
    uvec2 sun = pack_handed(indirect_near_sun(nodes, base, at, c.y, c.z, c.w)), sky = pack_handed(indirect_near_sky(nodes, base, at, c.y));
    results.items[6u * k] = vec4(handed_at(sun, z), 0.0);
    results.items[6u * k + 1u] = vec4(handed_at(sky, z), open_at(unpack_open(pack_open(indirect_open(nodes, base, at, c.y))), z));
    results.items[6u * k + 2u] = vec4(indirect_far_sun(nodes, base, at, c.y, c.z, c.w), 0.0);
    results.items[6u * k + 3u] = vec4(indirect_far_sky(nodes, base, at, c.y), 0.0);
    results.items[6u * k + 4u] = vec4(indirect_ground_sun(nodes, at, c.z), 0.0);
    results.items[6u * k + 5u] = vec4(indirect_ground_sky(nodes, at), 0.0);
}
