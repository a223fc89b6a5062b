// Draws of the trees in view that are clouds of cards: the full clouds, near to far, and the far forms; and how many trees of each species are such. One
// workgroup: it only counts.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(local_size_x = 256) in;
layout(binding = 0) uniform usamplerBuffer trees;
layout(std430, binding = 1) readonly buffer Lists { uint items[]; } lists;
layout(std430, binding = 2) readonly buffer Starts { uint items[]; } starts;
layout(std430, binding = 3) readonly buffer Totals { uint items[]; } totals;
layout(std430, binding = 4) buffer Kinds { CardKind items[]; } kinds;
layout(std430, binding = 5) writeonly buffer Draws { PlainDraw items[]; } draws;
layout(push_constant) uniform Push { CardParameters p; };

shared uint found[MAX_SPECIES];

// Trees of the lists before a bin.
uint before(uint bin) { return bin < DISTANCE_BINS ? starts.items[1u + bin] : totals.items[0]; }

void main() {
    uint thread = gl_LocalInvocationIndex;
    // Of more trees than fit nothing was written: the host refuses such a frame.
    uint end = totals.items[0] <= p.tree_capacity ? before(p.card_bins) : 0u;
    if (thread < MAX_SPECIES) found[thread] = 0u;
    barrier();
    for (uint place = thread; place < end; place += 256u) {
        int at = int(lists.items[place]) * 8;
        uint species = texelFetch(trees, at + 1).z & TREE_SPECIES, samples = texelFetch(trees, at + 5).w;
        if ((samples >> 12u & 15u) > (samples >> 8u & 15u)) atomicAdd(found[species], 1u);
    }
    barrier();
    if (thread < p.species_count) kinds.items[thread].tree_count = found[thread];
    if (thread == 0u) {
        uint whole = min(before(p.cloud_bins), end), first = min(before(p.far_bins), end);
        draws.items[0] = PlainDraw(6u * p.cloud_cards, whole, 0u, 0u);
        draws.items[1] = PlainDraw(6u * FAR_CARDS, end - first, 0u, 0u);
    }
}
