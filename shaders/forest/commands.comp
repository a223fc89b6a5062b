// Totals of the lists become draw commands: the camera's trees, bins one after the other, in four draws.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(local_size_x = 1) in;
layout(std430, binding = 0) readonly buffer Totals { uint items[]; } totals;
layout(std430, binding = 1) writeonly buffer Commands { DrawCommand items[]; } commands;
layout(std430, binding = 2) buffer Starts { uint items[]; } starts;
layout(push_constant) uniform Push { CullParameters p; };

void main() {
    // All trees that are seen; then the camera's list, bin after bin.
    starts.items[0] = 0u;
    uint at = 0u;
    for (uint bin = 0u; bin < DISTANCE_BINS; bin++) {
        starts.items[1u + bin] = at;
        at += totals.items[1u + bin];
    }
    // Beyond the capacity nothing was written: the host reads the totals and refuses such a frame.
    bool fits = totals.items[0] <= p.tree_capacity;
    uint ends[CAMERA_DRAWS] = uint[](p.near_bins, p.far_bins, p.converged_bins, DISTANCE_BINS);
    uint first = 0u;
    for (uint k = 0u; k < CAMERA_DRAWS; k++) {
        uint end = ends[k] < DISTANCE_BINS ? starts.items[1u + ends[k]] : at;
        commands.items[k] = DrawCommand(fits ? 6u * (end - first) : 0u, 1u, 0u, int(4u * first), 0u);
        first = end;
    }
}
