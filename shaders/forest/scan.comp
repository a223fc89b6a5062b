// Exclusive prefix sum over all counts, list after list: where each workgroup writes in each list. One workgroup.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(local_size_x = 256) in;
layout(std430, binding = 0) buffer Counts { uint items[]; } counts;
layout(std430, binding = 1) writeonly buffer Totals { uint items[]; } totals;
layout(push_constant) uniform Push { CullParameters p; };

shared uint sums[256];

// Sum of this thread's slice of one list.
uint slice_sum(uint first, uint last) {
    uint sum = 0u;
    for (uint k = first; k < last; k++) sum += counts.items[k];
    return sum;
}

void main() {
    uint thread = gl_LocalInvocationIndex;
    uint slice = (p.group_count + 255u) / 256u;
    for (uint list = 0u; list < TREE_LISTS; list++) {
        uint first = list * p.group_count + min(thread * slice, p.group_count);
        uint last = list * p.group_count + min((thread + 1u) * slice, p.group_count);
        sums[thread] = slice_sum(first, last);
        barrier();
        for (uint step = 1u; step < 256u; step <<= 1u) {
            uint before = thread >= step ? sums[thread - step] : 0u;
            barrier();
            sums[thread] += before;
            barrier();
        }
        uint at = thread > 0u ? sums[thread - 1u] : 0u;
        for (uint k = first; k < last; k++) {
            uint count = counts.items[k];
            counts.items[k] = at;
            at += count;
        }
        if (thread == 255u) totals.items[list] = sums[255];
        barrier();
    }
}
