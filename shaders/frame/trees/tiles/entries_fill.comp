// Writes every entry where the counts of the lists and parts before it say.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/tiles/order.glsl"
#include "frame/trees/tiles/entries.glsl"

layout(std430, binding = 4) writeonly buffer Entries { uint items[]; } entries;

#define WRITE(list, tree)                     \
    uint slot = (list) * p.list_lanes + lane; \
    uint to = counts.items[slot];             \
    entries.items[to] = tree;                 \
    counts.items[slot] = to + 1u

void main() { FOR_ENTRIES(WRITE) }
