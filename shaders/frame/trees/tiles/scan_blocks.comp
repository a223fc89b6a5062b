// The sum of each block of counts.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/tiles/scan.glsl"

void main() {
    uvec2 all = sums_before(part_sum(own_part(count_of_sums())));
    if (gl_LocalInvocationIndex == 0u) blocks.items[gl_WorkGroupID.x] = all.y;
}
