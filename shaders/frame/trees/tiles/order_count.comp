// How many trees each invocation's part of the camera's list has in each bin of depth.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "forest/wind.glsl"
#include "frame/trees/tiles/order.glsl"

layout(local_size_x = 8) in;
layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(std430, binding = 1) readonly buffer Trees { Tree items[]; } trees;
layout(std430, binding = 2) readonly buffer Lists { uint items[]; } lists;
layout(std140, binding = 3) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 4) readonly buffer Commands { DrawCommand items[]; } commands;
layout(std430, binding = 5) writeonly buffer Keys { uint items[]; } keys;
layout(std430, binding = 6) buffer Counts { uint items[]; } counts;
layout(std430, binding = 7) buffer State { TileState items[]; } state;

void main() {
    uint lane = gl_GlobalInvocationID.x;
    for (uint bin = 0u; bin < DEPTH_BINS; bin++) counts.items[bin * ORDER_LANES + lane] = 0u;
    uint count = 0u;
    for (uint k = 0u; k < CAMERA_DRAWS; k++) count += commands.items[k].index_count / 6u;
    // What frames of the same picture ran out of stays.
    uint overrun = view.v.frames_before > 0u ? state.items[0].overrun : 0u;
    if (lane == 0u) state.items[0] = TileState(count, 0u, 0u, overrun, uvec3((count + 63u) / 64u, 1u, 1u));
    uint part = (count + ORDER_LANES - 1u) / ORDER_LANES, last = min((lane + 1u) * part, count);
    mat4 m = view.v.clip_from_world;
    vec3 forward = vec3(m[0].w, m[1].w, m[2].w);
    for (uint k = lane * part; k < last; k++) {
        uint tree = lists.items[k];
        uint word = trees.items[tree].species;
        vec3 extent = species.items[species_row(word)].scale_to_metres * trees.items[tree].scale;
        float support = extent.x * length(forward.xy) + extent.z * abs(forward.z);
        // A sheared cylinder reaches farther.
        if (WIND) support += extent.z * length(forward.xy) * length(unpack_sway(word));
        uint bin = depth_bin(dot(forward, trees.items[tree].centre) - support);
        keys.items[k] = bin;
        counts.items[bin * ORDER_LANES + lane] += 1u;
    }
}
