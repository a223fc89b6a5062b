// Writes every place of the camera's list to where it comes in depth.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(local_size_x = 8) in;
layout(std430, binding = 0) readonly buffer Keys { uint items[]; } keys;
layout(std430, binding = 1) buffer Counts { uint items[]; } counts;
layout(std430, binding = 2) readonly buffer State { TileState items[]; } state;
layout(std430, binding = 3) writeonly buffer Order { uint items[]; } order;

void main() {
    uint lane = gl_GlobalInvocationID.x, count = state.items[0].tree_count;
    uint part = (count + ORDER_LANES - 1u) / ORDER_LANES, last = min((lane + 1u) * part, count);
    for (uint k = lane * part; k < last; k++) {
        uint at = keys.items[k] * ORDER_LANES + lane, slot = counts.items[at];
        order.items[slot] = k;
        counts.items[at] = slot + 1u;
    }
}
