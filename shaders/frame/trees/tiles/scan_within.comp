// Prefix sums within each block, on top of those of the blocks before; the total behind the last.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/tiles/scan.glsl"

void main() {
    uint count = count_of_sums();
    uvec2 part = own_part(count);
    uint at = blocks.items[gl_WorkGroupID.x] + sums_before(part_sum(part)).x;
    for (uint k = part.x; k < part.y; k++) {
        uint item = sums.items[k];
        sums.items[k] = at;
        at += item;
    }
    if (part.x < part.y && part.y == count) sums.items[count] = at;
    if (count == 0u && gl_GlobalInvocationID.x == 0u) sums.items[0] = 0u;
}
