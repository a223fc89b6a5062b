// How many entries of each invocation's part go into each list.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/tiles/order.glsl"
#include "frame/trees/tiles/entries.glsl"

#define COUNT(list, tree) counts.items[(list) * p.list_lanes + lane] += 1u

void main() {
    FOR_ENTRIES(COUNT)
    if (lane == 0u) {
        state.items[0].step_count = total;
        state.items[0].whole = total > p.step_capacity ? 1u : 0u;
    }
}
