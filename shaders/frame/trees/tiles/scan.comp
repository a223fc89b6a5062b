// Exclusive prefix sum in place, and the total behind the last. One workgroup.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(local_size_x = 256) in;
layout(std430, binding = 0) buffer Sums { uint items[]; } sums;
layout(std430, binding = 1) readonly buffer State { TileState items[]; } state;
layout(push_constant) uniform Push { uint given; }; // 0: one a tree

shared uint parts[256];

void main() {
    uint count = given > 0u ? given : state.items[0].tree_count;
    uint thread = gl_LocalInvocationIndex, part = (count + 255u) / 256u;
    uint first = min(thread * part, count), last = min(first + part, count), sum = 0u;
    for (uint k = first; k < last; k++) sum += sums.items[k];
    parts[thread] = sum;
    barrier();
    for (uint step = 1u; step < 256u; step <<= 1u) {
        uint before = thread >= step ? parts[thread - step] : 0u;
        barrier();
        parts[thread] += before;
        barrier();
    }
    uint at = thread > 0u ? parts[thread - 1u] : 0u;
    for (uint k = first; k < last; k++) {
        uint item = sums.items[k];
        sums.items[k] = at;
        at += item;
    }
    if (thread == 255u) sums.items[count] = at;
}
