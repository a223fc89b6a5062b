// Exclusive prefix sums of the sums of blocks. One workgroup.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/tiles/scan.glsl"

void main() {
    uint lane = gl_LocalInvocationIndex, count = (count_of_sums() + SCAN_BLOCK - 1u) / SCAN_BLOCK;
    uint part = (count + SCAN_LANES - 1u) / SCAN_LANES;
    uint first = min(lane * part, count), last = min(first + part, count), sum = 0u;
    for (uint k = first; k < last; k++) sum += blocks.items[k];
    uint at = sums_before(sum).x;
    for (uint k = first; k < last; k++) {
        uint item = blocks.items[k];
        blocks.items[k] = at;
        at += item;
    }
}
