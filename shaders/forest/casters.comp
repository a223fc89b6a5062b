// The trees of seed quads that cast into what is drawn of a shadow cascade, with all that is the same for a whole tree. Their
// order is that in which workgroups come: a shadow map keeps the nearest of what is drawn to it, in whichever order.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/views.glsl"
#include "forest/wind.glsl"
#include "forest/sway.glsl"
#include "forest/casters.glsl"

layout(local_size_x = 256) in;
layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(std430, binding = 1) readonly buffer Quads { CasterQuad items[]; } quads;
layout(std430, binding = 2) readonly buffer Blocks { ShadowBlock items[]; } blocks;
layout(std430, binding = 3) readonly buffer Sums { uint items[]; } sums;
layout(std430, binding = 4) readonly buffer Draws { DrawCommand items[]; } draws;
layout(std430, binding = 5) readonly buffer Seeds { Seed items[]; } seeds;
layout(std140, binding = 6) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 7) writeonly buffer Casters { Caster items[]; } casters;
layout(std430, binding = 8) buffer Commands { DrawCommand items[]; } commands;
layout(std430, binding = 9) buffer MeshCommands { PlainDraw items[]; } mesh_commands; // of the same casters as meshes
layout(push_constant) uniform Push { CasterParameters p; };
layout(constant_id = 0) const int VIEW_RINGS = 9;
layout(constant_id = 1) const float VIEW_RESOLUTION = 256.0;

shared uint members[8];
shared uint first_record;

// Whether any page of a rectangle is drawn: from sums over all pages before in x and y.
bool any_drawn(ShadowBlock b, ivec4 pages) {
    if (any(greaterThan(pages.xy, pages.zw))) return false;
    const int row = int(SHADOW_PAGES) + 1;
    int south = b.sums + pages.y * row, north = b.sums + (pages.w + 1) * row;
    return sums.items[north + pages.z + 1] - sums.items[north + pages.x] - sums.items[south + pages.z + 1] +
               sums.items[south + pages.x] > 0u;
}

Caster make_caster(ShadowBlock b, uint phases, Seed s, vec3 place, Species kind) {
    Caster t;
    t.place = place;
    t.scale = s.scale;
    float angle = float(s.turn_tint & 0xffffu) * (2.0 * 3.14159265358979 / 65536.0);
    t.turn = vec2(cos(angle), sin(angle));
    t.species = s.species_density & 0xffffu;
    mat3 back = mat3(t.turn.x, -t.turn.y, 0.0, t.turn.y, t.turn.x, 0.0, 0.0, 0.0, 1.0);
    uvec3 layers;
    vec3 weights;
    vec3 toward = back * view.v.sun_direction;
    if (WIND) {
        uint sway = seed_sway(view.v, phases, s, kind, t.turn);
        vec3 moved = vec3(unpack_sway(sway) * (kind.centre * s.scale), 0.0) * back;
        t.place += vec3(dot(b.x, moved), dot(b.y, moved), dot(b.z, moved));
        t.species |= sway;
        toward = unswayed(sway, toward);
    }
    view_lookup(toward / kind.scale_to_metres, VIEW_RINGS, layers, weights);
    t.light_layers = layers.x | layers.y << 10u | layers.z << 20u;
    t.light_weights = weights.xy;
    float width = 2.0 * max(kind.scale_to_metres.x, kind.scale_to_metres.z) * s.scale;
    t.mip = clamp(floor(log2(VIEW_RESOLUTION / (width * b.texels_per_metre)) + 0.5), 0.0, log2(VIEW_RESOLUTION));
    t.dither = (hash(s.identity ^ HASH_DITHER ^ b.cascade) & ~255u) | caster_name(s.identity);
    return t;
}

void main() {
    uint thread = gl_LocalInvocationIndex, word = thread >> 5u, bit = 1u << (thread & 31u);
    if (thread < 8u) members[thread] = 0u;
    barrier();
    CasterQuad q = quads.items[p.first_quad + gl_WorkGroupID.x / p.groups_per_region];
    ShadowBlock b = blocks.items[q.block];
    uint slot = (gl_WorkGroupID.x % p.groups_per_region) * CULL_GROUP + thread;
    bool casts = false;
    Seed s;
    Species kind;
    vec3 place;
    if (slot < draws.items[q.region].index_count / 6u) {
        s = seeds.items[q.region * p.region_capacity + slot];
        kind = species.items[s.species_density & 0xffffu];
        place = caster_place(b, q, s, kind);
        precise float radius = kind.bounding_radius * s.scale;
        casts = any_drawn(b, caster_pages(b, place, radius, VIEW_RESOLUTION));
    }
    if (casts) atomicOr(members[word], bit);
    barrier();
    uint rank = 0u, count = 0u;
    for (uint w = 0u; w < 8u; w++) {
        uint bits = uint(bitCount(members[w]));
        rank += w < word ? bits : 0u;
        count += bits;
    }
    rank += uint(bitCount(members[word] & (bit - 1u)));
    if (thread == 0u && count > 0u) {
        atomicAdd(mesh_commands.items[p.first_command + q.block].instance_count, count);
        first_record = q.base + atomicAdd(commands.items[p.first_command + q.block].index_count, 6u * count) / 6u;
    }
    barrier();
    if (casts) casters.items[first_record + rank] = make_caster(b, q.wind_phases, s, place, kind);
}
