// Which seeds does the camera see? Writes each seed's class and, a workgroup, how many of its seeds are in each list. Twin of the decision: src/forest/cull.rs.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/handover.glsl"
#include "forest/cull.glsl"
#include "forest/members.glsl"

layout(local_size_x = 256) in;
layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(std430, binding = 1) readonly buffer Quads { SeedQuad items[]; } quads;
layout(std430, binding = 2) readonly buffer Draws { DrawCommand items[]; } draws;
layout(std430, binding = 3) readonly buffer Seeds { Seed items[]; } seeds;
layout(std140, binding = 4) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 5) writeonly buffer Classes { uint items[]; } classes;
layout(std430, binding = 6) writeonly buffer Counts { uint items[]; } counts;
layout(binding = 7) uniform sampler2DArray heights;
layout(push_constant) uniform Push { CullParameters p; };

void main() {
    uint thread = gl_LocalInvocationIndex;
    clear_members(thread);
    SeedQuad q = quads.items[gl_WorkGroupID.x / p.groups_per_region];
    uint slot = (gl_WorkGroupID.x % p.groups_per_region) * CULL_GROUP + thread;
    uint seen = 0u;
    if (slot < draws.items[q.region].index_count / 6u) {
        Seed s = seeds.items[q.region * p.region_capacity + slot];
        Species kind = species.items[s.species_density & 0xffffu];
        seen = classify(view.v, q, s, kind, tree_centre(view.v, q, s, kind), heights);
    }
    classes.items[gl_WorkGroupID.x * CULL_GROUP + thread] = seen;
    enlist(seen, thread);
    barrier();
    if (thread < TREE_LISTS) {
        uint count = 0u;
        for (uint w = 0u; w < 8u; w++) count += uint(bitCount(members[thread * 8u + w]));
        counts.items[thread * p.group_count + gl_WorkGroupID.x] = count;
    }
}
