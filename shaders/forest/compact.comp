// Ordered compaction: each seen seed becomes one tree record, and its index goes into the lists that it is in, in the
// order of seeds. All that is the same for a whole tree is computed here, once.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/views.glsl"
#include "physics/light.glsl"
#include "physics/correction.glsl"
#include "physics/transfer.glsl"
#include "physics/forest.glsl"
#include "physics/handover.glsl"
#include "physics/shadow.glsl"
#include "physics/masks.glsl"
#include "physics/indirect.glsl"
#include "forest/wind.glsl"
#include "forest/sway.glsl"
#include "forest/cull.glsl"
#include "forest/members.glsl"

layout(local_size_x = 256) in;
layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(std430, binding = 1) readonly buffer Quads { SeedQuad items[]; } quads;
layout(std430, binding = 2) readonly buffer Seeds { Seed items[]; } seeds;
layout(std140, binding = 3) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 4) readonly buffer Classes { uint items[]; } classes;
layout(std430, binding = 5) readonly buffer Counts { uint items[]; } counts;
layout(std430, binding = 6) readonly buffer Starts { uint items[]; } starts;
layout(std430, binding = 7) writeonly buffer Trees { Tree items[]; } trees;
layout(std430, binding = 8) writeonly buffer Lists { uint items[]; } lists;
layout(std430, binding = 9) readonly buffer Totals { uint items[]; } totals;
layout(push_constant) uniform Push { CullParameters p; };
layout(constant_id = 0) const int VIEW_RINGS = 9;
layout(constant_id = 1) const float VIEW_RESOLUTION = 256.0;
layout(constant_id = 2) const float TABLE_ANGLES = 16.0;
layout(constant_id = 3) const float TABLE_DENSITIES = 8.0;
layout(constant_id = 5) const uint SAMPLES = 4u;
layout(constant_id = 4) const bool PAIR_TABLES = true; // the sun's average light is known, and has a share
layout(binding = 10) uniform sampler3D pair_table;
layout(binding = 11) uniform sampler2DArray view_table;
layout(binding = 12) uniform sampler2DArray heights;
layout(binding = 13) uniform samplerBuffer indirect;
layout(std430, binding = 14) writeonly buffer HandedTable { HandedLight items[]; } handed_light;
layout(constant_id = 6) const bool INDIRECT = false;
layout(constant_id = 7) const int INDIRECT_FIRST = 0;  // texel where the first species' begins
layout(constant_id = 8) const int INDIRECT_NODES = 2;  // of the density

uint rank_in(uint list, uint thread) {
    uint rank = 0u, word = thread >> 5u;
    for (uint w = 0u; w < word; w++) rank += uint(bitCount(members[list * 8u + w]));
    return rank + uint(bitCount(members[list * 8u + word] & ((1u << (thread & 31u)) - 1u)));
}

// Lower-hemisphere directions use the opposite view from behind: bit 31 says so.
uint lookup(vec3 w, out vec2 weights) {
    uvec3 layers;
    vec3 all;
    bool below = w.z < 0.0;
    view_lookup(below ? -w : w, VIEW_RINGS, layers, all);
    weights = all.xy;
    return layers.x | layers.y << 10u | layers.z << 20u | (below ? 1u << 31u : 0u);
}

// The light of the average tree around this one, towards which its own converges with nu (BN12, eq. 22 and 23); returns what of it is
// lit.
float average_light(inout Tree t, Species kind, TableSlope slope, vec3 ground, float x, float nu) {
    TableForest f = table_forest(pair_table, view_table, slope, x, TableKnown(x, x, x, x, x), kind.max_thickness, float(t.species),
                                 TABLE_ANGLES, TABLE_DENSITIES, PAIR_TABLES, false, 1.0);
    float lit = nu * sun_facing(view.v.sun_direction, ground);
    t.mean_sun = (lit * f.transfer) * t.sun * (f.sun.x + f.sun.y * kind.bark_ratio);
    t.mean_sky = nu * t.sky * (f.sky.x + f.sky.y * kind.bark_ratio);
    return lit * (f.sun.x + f.sun.y);
}

// Opacity factor of a tree: faded out at its range, or on a silhouette, at the farther one.
float range_fade(SeedQuad q, Seed s, vec3 centre, Species kind, float relative) {
    float u = unit(hash(s.identity ^ HASH_FADE)), near = tree_fade(relative, u), height = tree_height(kind, s.scale);
    bool asked = near < 1.0 && view.v.silhouette_ratio > 1.0;
    float clearance = silhouette(view.v, q, s, centre, height, heights, asked);
    return max(near, silhouette_opacity(clearance, height) * tree_fade(relative / view.v.silhouette_ratio, u));
}

// Unit normal of the ground that a tree stands on, and the density at which its species alone would cover what all trees there do.
vec3 ground_of(Seed s) { return normalize(vec3(-unpackHalf2x16(s.slope), 1.0)); }
float density_of(Seed s) {
    float root = unpackHalf2x16(s.species_density).y;
    return root * root;
}

// Opacity of what a tree is to a range, a unit of its scale.
float fade_to(float range, Seed s, float distance) {
    return range > 0.0 ? tree_fade(distance / (range * s.scale), unit(hash(s.identity ^ HASH_FADE))) : 0.0;
}

// In how many samples a tree is its mesh, and in how many that or its cloud of cards, rounded as opacities are, once a tree. Both with the same
// dither, so that the second are no fewer.
uint near_samples(Seed s, Species kind, float distance, float fade) {
    float dither = unit(hash(s.identity ^ HASH_MESH));
    uint mesh = covered_samples(fade_to(kind.mesh_range, s, distance), dither, SAMPLES);
    uint cards = covered_samples(fade * fade_to(kind.card_range, s, distance), dither, SAMPLES);
    return mesh << 8u | max(mesh, cards) << 12u;
}

Tree make_tree(SeedQuad q, Seed s, vec3 centre, Species kind) {
    View v = view.v;
    Tree t;
    t.centre = centre;
    t.scale = s.scale;
    float angle = float(s.turn_tint & 0xffffu) * (2.0 * PI / 65536.0);
    t.turn = vec2(cos(angle), sin(angle));
    t.species = s.species_density & 0xffffu;
    t.identity = s.identity;
    // World to scaled tree space: rotate back, then divide by the half extents.
    mat3 back = mat3(t.turn.x, -t.turn.y, 0.0, t.turn.y, t.turn.x, 0.0, 0.0, 0.0, 1.0);
    float distance = max(length(centre), 1e-6);
    vec3 to_camera = -centre / distance;
    vec2 weights;
    uint sway = 0u;
    vec3 viewer = back * to_camera, eye = back * -centre, toward = back * v.sun_direction;
    if (WIND) {
        // The tree sways, and its middle with it; to the views around, it stands still.
        sway = seed_sway(v, q.wind_phases, s, kind, t.turn);
        vec2 moved = unpack_sway(sway) * (kind.centre * s.scale);
        t.centre.xy += vec2(t.turn.x * moved.x - t.turn.y * moved.y, t.turn.y * moved.x + t.turn.x * moved.y);
        eye = unswayed(sway, back * -t.centre);
        viewer = eye;
        toward = unswayed(sway, toward);
    }
    t.view_layers = lookup(viewer / kind.scale_to_metres, weights);
    t.view_weights = weights;
    t.light_layers = lookup(toward / kind.scale_to_metres, weights);
    t.light_weights = weights;
    // One integer mip a tree: texels of 0.35 to 0.7 pixels on the wider side of the box, because bilinear filters are two
    // texels wide. A level coarser blurs neighbouring crowns into each other's gaps, and more ground shows than should.
    float extent = 2.0 * max(kind.scale_to_metres.x, kind.scale_to_metres.z) * s.scale;
    float texels_per_pixel = VIEW_RESOLUTION * distance / (extent * v.pixels_at_1m);
    t.mip = clamp(floor(log2(max(texels_per_pixel, 1e-6)) - 0.5), 0.0, log2(VIEW_RESOLUTION));
    // Trees end smoothly at their range (BN12, section 7), and where the camera enters the crown.
    float relative = distance / kind.range;
    eye = eye / (kind.scale_to_metres * s.scale);
    float inside = max(length(eye.xy), abs(eye.z));
    float fade = range_fade(q, s, centre, kind, relative);
    t.fade = fade * smoothstep(1.05, 1.35, inside);
    vec3 ground = ground_of(s);
    float density = density_of(s);
    float tint = 1.0 + 0.3 * (float(s.turn_tint >> 16u) / 65535.0 - 0.5);
    float phase_angle = angle_between(to_camera, v.sun_direction);
    vec3 phase = leaf_phase(to_camera, v.sun_direction, turned_reflectance(kind.reflectance, kind.turning, phase_angle), kind.transmittance);
    t.sun = tint * phase * hotspot(to_camera, v.sun_direction, v.hotspot_amplitude, v.hotspot_width) * v.sun_irradiance;
    // rho / 2 of a leaf that the upper hemisphere lights, times the visibility of the sky above a slope.
    float thickness = density * kind.mean_area, species = float(t.species);
    t.sky = tint * kind.albedo * (0.5 * sky_over_slope(ground.z, thickness)) * v.sky_radiance;
    TableSlope slope = table_slope(view_table, to_camera, v.sun_direction, ground, kind.vertical_scale, species, TABLE_ANGLES,
                                   TABLE_DENSITIES, PAIR_TABLES);
    float nu = converged(relative, v.convergence), mean_lit = average_light(t, kind, slope, ground, thickness, nu);
    // The tables' average has it already.
    CorrectionTerms y = correction_terms(to_camera.z, v.sun_direction.z, phase_angle);
    vec2 lit = correction_line(kind.lit, y, transfer_strength(sqrt(phase_angle))), sent = correction_line(kind.sent, y, 1.0);
    float middle = max(sent.x, 0.05);
    t.sun *= middle;
    t.hole_change = packHalf2x16(vec2(density * kind.hole, sent.y / middle));
    t.own_lit = packHalf2x16(vec2(1.0 - nu, lit.x));
    t.mean_lit_change = packHalf2x16(vec2(mean_lit, lit.y));
    // What the hole leaves of it, brought to what is seen of the tables' forest along this direction, unless it was measured by height.
    if (!INDIRECT) t.sky *= table_ground(view_table, table_zenith(slope.u.v, TABLE_ANGLES), table_density(thickness, kind.max_thickness, TABLE_DENSITIES),
                          species, TABLE_ANGLES, TABLE_DENSITIES).z;
    t.cascade_tint = cascade_at(v.cascade_far, v.cascade_count, distance) | near_samples(s, kind, distance, fade) | packHalf2x16(vec2(0.0, tint));
    t.species |= sway;
    return t;
}

// Light that met more than one surface, of a tree among others of thickness x.
HandedLight handed_on(Tree t, Species kind, vec3 ground, float x) {
    vec3 l = view.v.sun_direction, to_camera = -normalize(t.centre);
    int base = INDIRECT_FIRST + int(species_row(t.species)) * INDIRECT_NODES * INDIRECT_NODE;
    IndirectAt at = indirect_at(x, texelFetch(indirect, 0).w, INDIRECT_NODES);
    Handed sun = indirect_near_sun(indirect, base, at, to_camera.z, l.z, dot(to_camera, l)), sky = indirect_near_sky(indirect, base, at, to_camera.z);
    float tint = unpackHalf2x16(t.cascade_tint).y;
    sun.colour *= (tint * sun_facing(l, ground)) * view.v.sun_irradiance;
    sky.colour *= tint * view.v.sky_radiance;
    vec4 open = indirect_open(indirect, base, at, to_camera.z);
    return HandedLight(pack_handed(sun), pack_handed(sky), pack_open(open), uvec2(0u));
}

void main() {
    uint thread = gl_LocalInvocationIndex, group = gl_WorkGroupID.x;
    clear_members(thread);
    uint seen = classes.items[group * CULL_GROUP + thread];
    enlist(seen, thread);
    barrier();
    if (seen == 0u || totals.items[0] > p.tree_capacity) return;
    SeedQuad q = quads.items[group / p.groups_per_region];
    Seed s = seeds.items[q.region * p.region_capacity + (group % p.groups_per_region) * CULL_GROUP + thread];
    Species kind = species.items[s.species_density & 0xffffu];
    uint index = counts.items[group] + rank_in(0u, thread);
    Tree t = make_tree(q, s, tree_centre(view.v, q, s, kind), kind);
    trees.items[index] = t;
    if (INDIRECT) handed_light.items[index] = handed_on(t, kind, ground_of(s), density_of(s) * kind.mean_area);
    uint list = 1u + (seen & 31u);
    lists.items[starts.items[list] + counts.items[list * p.group_count + group] + rank_in(list, thread)] = index;
}
