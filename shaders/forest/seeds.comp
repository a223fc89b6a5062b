// Seeds of one quad: points of its Wang tiles, thinned to the local density, then its listed trees; compacted in
// order, as transform feedback would. One workgroup a quad.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/terrain.glsl"

layout(local_size_x = 256) in;
layout(std430, binding = 0) readonly buffer Quads { SeedQuad items[]; } quads;
layout(std430, binding = 1) readonly buffer Pattern { PatternPoint items[]; } pattern;
layout(std430, binding = 2) readonly buffer Listed { ListedTree items[]; } listed;
layout(std140, binding = 3) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 4) writeonly buffer Seeds { Seed items[]; } seeds;
layout(std430, binding = 5) writeonly buffer Draws { DrawCommand items[]; } draws;
layout(binding = 6) uniform sampler2DArray heights;
layout(binding = 7) uniform sampler2DArray densities;
layout(std430, binding = 8) readonly buffer SceneSize { uint species_count; } scene_size;
layout(push_constant) uniform Push { SeedParameters p; };

#include "land/density.glsl"
#include "land/candidate.glsl"

shared uint kept[8];

void main() {
    SeedQuad q = quads.items[p.first_quad + gl_WorkGroupID.x];
    uint thread = gl_LocalInvocationIndex;
    uint pattern_count = p.tiles_per_side * p.tiles_per_side * p.points_per_tile;
    uint total = pattern_count + q.position_count, written = 0u;
    for (uint first = 0u; first < total; first += 256u) {
        if (thread < 8u) kept[thread] = 0u;
        barrier();
        Seed s;
        bool keep = first + thread < total && candidate(q, first + thread, pattern_count, s);
        // A ballot in shared memory: the order of the atomics does not change the bits.
        if (keep) atomicOr(kept[thread >> 5u], 1u << (thread & 31u));
        barrier();
        uint rank = 0u, count = 0u;
        for (uint w = 0u; w < 8u; w++) {
            uint bits = uint(bitCount(kept[w]));
            rank += w < thread >> 5u ? bits : 0u;
            count += bits;
        }
        rank += uint(bitCount(kept[thread >> 5u] & ((1u << (thread & 31u)) - 1u)));
        if (keep && written + rank < p.region_capacity) {
            seeds.items[q.region * p.region_capacity + written + rank] = s;
        }
        written += count;
        barrier();
    }
    if (thread == 0u) {
        written = min(written, p.region_capacity);
        draws.items[q.region] =
            DrawCommand(6u * written, 1u, 0u, int(4u * q.region * p.region_capacity), 0u);
    }
}
