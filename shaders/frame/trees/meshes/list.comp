// Trees in view that are meshes, species by species, each near to far in the order of the camera's lists; and the draws of them. One
// workgroup: there are few such trees, in the first bins of the lists.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(local_size_x = 256) in;
layout(binding = 0) uniform usamplerBuffer trees;
layout(std430, binding = 1) readonly buffer Lists { uint items[]; } lists;
layout(std430, binding = 2) readonly buffer Starts { uint items[]; } starts;
layout(std430, binding = 3) readonly buffer Totals { uint items[]; } totals;
layout(std430, binding = 4) buffer Draws { MeshDraw items[]; } draws;
layout(std430, binding = 5) writeonly buffer MeshTrees { uint items[]; } mesh_trees;
layout(push_constant) uniform Push { MeshParameters p; };

shared uint members[MAX_SPECIES * 8u]; // of each species, which of 256 trees
shared uint found[MAX_SPECIES];

// The species of the tree at a place of the lists; MAX_SPECIES where it is no mesh.
uint species_at(uint place, uint end) {
    int at = int(lists.items[min(place, max(end, 1u) - 1u)]) * 8;
    uint species = texelFetch(trees, at + 1).z & TREE_SPECIES, samples = texelFetch(trees, at + 5).w >> 8u & 0xffu;
    return place < end && samples > 0u ? species : MAX_SPECIES;
}

void main() {
    uint thread = gl_LocalInvocationIndex;
    uint end = p.bins < DISTANCE_BINS ? starts.items[1u + p.bins] : totals.items[0];
    if (thread < MAX_SPECIES) found[thread] = 0u;
    barrier();
    for (uint first = 0u; first < end; first += 256u) {
        uint species = species_at(first + thread, end);
        if (species < MAX_SPECIES) atomicAdd(found[species], 1u);
    }
    barrier();
    if (thread == 0u) {
        uint total = 0u;
        for (uint k = 0u; k < p.species_count; k++) {
            draws.items[k].first_tree = total;
            draws.items[k].instance_count = found[k];
            total += found[k];
        }
        // More than there is room for are none: the host reads how many there were, and refuses such a frame.
        for (uint k = 0u; k < p.species_count; k++) draws.items[k].vertex_count = total <= MESH_TREES ? 3u * draws.items[k].face_count : 0u;
        uint before = 0u;
        for (uint k = 0u; k < MAX_SPECIES; k++) {
            uint count = found[k];
            found[k] = before;
            before += count;
        }
    }
    barrier();
    for (uint first = 0u; first < end; first += 256u) {
        for (uint k = thread; k < MAX_SPECIES * 8u; k += 256u) members[k] = 0u;
        barrier();
        uint species = species_at(first + thread, end), word = thread >> 5u, bit = 1u << (thread & 31u);
        if (species < MAX_SPECIES) atomicOr(members[species * 8u + word], bit);
        barrier();
        if (species < MAX_SPECIES) {
            uint place = found[species] + uint(bitCount(members[species * 8u + word] & (bit - 1u)));
            for (uint w = 0u; w < word; w++) place += uint(bitCount(members[species * 8u + w]));
            if (place < MESH_TREES) mesh_trees.items[place] = lists.items[first + thread];
        }
        barrier();
        if (thread < MAX_SPECIES) {
            for (uint w = 0u; w < 8u; w++) found[thread] += uint(bitCount(members[thread * 8u + w]));
        }
        barrier();
    }
}
