// Trees in view that are meshes, species by species, each near to far in the order of the camera's lists; how much of each is drawn, by its size on the screen; and
// the draws of that, two a tree: a whole model, or what is drawn of its leaves and then a level of its bark. One workgroup: there are few such trees, in the first bins of the lists.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/levels.glsl"

layout(local_size_x = 256) in;
layout(binding = 0) uniform usamplerBuffer trees;
layout(std430, binding = 1) readonly buffer Lists { uint items[]; } lists;
layout(std430, binding = 2) readonly buffer Starts { uint items[]; } starts;
layout(std430, binding = 3) readonly buffer Totals { uint items[]; } totals;
layout(std430, binding = 4) buffer Kinds { MeshKind items[]; } kinds;
layout(std430, binding = 5) writeonly buffer MeshTrees { MeshTree items[]; } mesh_trees;
layout(std140, binding = 6) uniform ViewBuffer { View v; } view;
layout(binding = 7) uniform usamplerBuffer faces;
layout(binding = 8) uniform usamplerBuffer indices;
layout(std430, binding = 9) writeonly buffer Draws { DrawCommand items[]; } draws;
layout(std430, binding = 10) writeonly buffer DrawCount { uint items[]; } draw_count;
layout(push_constant) uniform Push { MeshParameters p; };

shared uint members[MAX_SPECIES * 8u]; // of each species, which of 256 trees
shared uint found[MAX_SPECIES];
shared bool room;
shared uint end_of_all;

// The species of the tree at a place of the lists; MAX_SPECIES where it is no mesh.
uint species_at(uint place, uint end) {
    int at = int(lists.items[min(place, max(end, 1u) - 1u)]) * 8;
    uint species = texelFetch(trees, at + 1).z & TREE_SPECIES, samples = texelFetch(trees, at + 5).w >> 8u & 15u;
    return place < end && samples > 0u ? species : MAX_SPECIES;
}

// What of a tree is drawn.
MeshTree chosen(uint tree, uint species) {
    uvec4 a = texelFetch(trees, int(tree) * 8);
    float metre = view.v.pixels_at_1m * uintBitsToFloat(a.w) / max(length(uintBitsToFloat(a.xyz)), 1e-6);
    float share = leaf_share(kinds.items[species].card_side * metre, p.leaf_pixels);
    float octave = clamp(-log2(share), 0.0, float(LEAF_OCTAVES - 1u));
    uint k = min(uint(octave), LEAF_OCTAVES - 2u), bark = 0u;
    float pull = mix(kinds.items[species].pull[k], kinds.items[species].pull[k + 1u], octave - float(k));
    for (uint level = 1u; level < kinds.items[species].bark_levels; level++) {
        bark = share < 1.0 && kinds.items[species].bark_error[level] * metre <= BARK_PIXELS ? level : bark;
    }
    return MeshTree(tree, share, pull, bark);
}

// How many of a species' triangles of leaves, in the order of their cards, come before a rank.
uint leaves_before(uint species, float rank) {
    uint low = 0u, high = kinds.items[species].leaf_count;
    while (low < high) {
        uint middle = (low + high) / 2u;
        uint face = texelFetch(indices, int(kinds.items[species].first_leaf + 3u * middle)).x / 3u;
        bool before = uintBitsToFloat(texelFetch(faces, int(face)).z) < rank;
        low = before ? middle + 1u : low;
        high = before ? high : middle;
    }
    return low;
}

// Writes a tree at a place of the list, and its draws.
void put_tree(uint place, uint tree, uint species) {
    MeshTree t = chosen(tree, species);
    bool whole = t.share >= 1.0;
    uint instance = p.named != 0u ? place : 0u;
    uint leaves = whole ? kinds.items[species].face_count : leaves_before(species, drawn_end(t.share));
    uint first = whole ? kinds.items[species].first_whole : kinds.items[species].first_leaf;
    uint bark = whole ? 0u : kinds.items[species].bark_count[t.bark];
    mesh_trees.items[place] = t;
    draws.items[MESH_DRAWS * place] = DrawCommand(3u * leaves, 1u, first, 0, instance);
    draws.items[MESH_DRAWS * place + 1u] = DrawCommand(3u * bark, 1u, kinds.items[species].first_bark[t.bark], 0, instance);
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
            kinds.items[k].tree_count = found[k];
            total += found[k];
        }
        // More than there is room for are none: the host reads how many there were, and refuses such a frame.
        draw_count.items[0] = total <= MESH_TREES ? MESH_DRAWS * total : 0u;
        room = total <= MESH_TREES;
        end_of_all = total;
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
            if (room) put_tree(place, lists.items[first + thread], species);
        }
        barrier();
        if (thread < MAX_SPECIES) {
            for (uint w = 0u; w < 8u; w++) found[thread] += uint(bitCount(members[thread * 8u + w]));
        }
        barrier();
    }
    // Where draws are recorded one by one, those of no tree are empty.
    for (uint k = (room ? end_of_all : 0u) * MESH_DRAWS + thread; p.named == 0u && k < MESH_TREES * MESH_DRAWS; k += 256u) {
        draws.items[k] = DrawCommand(0u, 0u, 0u, 0, 0u);
    }
}
