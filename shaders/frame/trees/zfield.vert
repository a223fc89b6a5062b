// A camera-facing quad around one tree. Everything that the fragment needs is linear along rays, so it is interpolated
// over the quad (at p) and passed at the eye (at c): the value at p + s (c - p) follows from the two.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/light.glsl"
#include "physics/transfer.glsl"
#include "physics/zfield.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/camera.glsl"
#include "frame/trees/tiles/box.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(std430, binding = 1) readonly buffer Trees { Tree items[]; } trees;
layout(std430, binding = 2) readonly buffer Lists { uint items[]; } lists;
layout(std140, binding = 3) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 4) readonly buffer Bases { ViewBasis items[]; } bases;
layout(std430, binding = 5) readonly buffer Masks { uvec4 items[]; } masks;
layout(constant_id = 0) const int VIEW_RINGS = 9;
layout(constant_id = 1) const float VIEW_RESOLUTION = 256.0;
layout(constant_id = 2) const uint MASK_ROWS = 12u;

layout(location = 0) out vec4 view_p[3];        // in the three views; w of the first: height in the tree
layout(location = 3) out vec3 light_p[3];
layout(location = 6) out vec3 shadow_p;
layout(location = 7) flat out vec4 view_c[3];   // w: layer
layout(location = 10) flat out vec4 light_c[3]; // w: layer
layout(location = 13) flat out vec3 light_d[3]; // of one metre towards the sun
layout(location = 16) flat out vec4 shadow_c;   // w: depth of one metre towards the sun
layout(location = 17) flat out vec4 weights;    // of two views, of two light views
layout(location = 18) flat out vec4 optics;     // mip, tau of the self-shadow times the phase angle, opacity factor, height of the eye in the tree
layout(location = 19) flat out vec4 sun;        // w: 1 / r2 of the hole
layout(location = 20) flat out vec4 sky;        // w: metres from the centre to the top
layout(location = 21) flat out uvec4 tree_bits; // mask row; cascade | from below << 4 | species << 5 | name << 8 | half of the lit share's change << 16
layout(location = 22) flat out vec4 own;       // dither, c of the self-shadow times the root of the phase angle, lit share's correction, sun's change
layout(location = 23) flat out vec4 bark_ratio; // relative colour; w: height under which there is only bark
layout(location = 24) flat out vec4 mean_sun;   // average light, times nu; w: 1 - nu
layout(location = 26) flat out vec4 sun_from;   // in the tree's own axes; w: strength of light transfer
layout(std430, binding = 10) readonly buffer HandedTable { HandedLight items[]; } handed_light;
layout(constant_id = 10) const bool INDIRECT = false;
layout(location = 27) flat out uvec4 handed;    // light that met more than one surface: the sun's, the sky's
layout(location = 28) flat out uvec2 handed_sky; // and what there is of the sky's over what the z-field knows
layout(location = 25) flat out vec4 mean_sky;   // w: average lit fraction, times nu

void main() {
    View v = view.v;
    uint index = lists.items[gl_VertexIndex >> 2];
    Tree t = trees.items[index];
    Species kind = species.items[species_row(t.species)];
    TreePlane plane = tree_plane(t, kind);
    vec3 c = resting(t, -t.centre) / plane.half_extent;

    vec3 layers = unpack_layers(t.view_layers, kind.first_layer);
    vec3 light_layers = unpack_layers(t.light_layers, kind.first_layer);
    bool below = t.view_layers >> 31u != 0u;

    vec4 extent = quad_extent(plane, t.mip, bases.items[uint(layers.x)].bounds, bases.items[uint(layers.y)].bounds,
                              bases.items[uint(layers.z)].bounds, below, VIEW_RINGS, VIEW_RESOLUTION);
    uint corner = gl_VertexIndex & 3u;
    vec3 p = plane.right * ((corner & 1u) == 0u ? extent.x : extent.y) + plane.up * ((corner & 2u) == 0u ? extent.z : extent.w);
    vec3 position = world_from_tree(t, kind, p);
    gl_Position = v.clip_from_world * vec4(position, 1.0);

    vec3 toward = resting(t, v.sun_direction);
    vec3 l = toward / plane.half_extent;
    for (int i = 0; i < 3; i++) {
        ViewBasis b = bases.items[uint(layers[i])];
        view_p[i] = vec4(project(b, p), p.z);
        view_c[i] = vec4(project(b, c), layers[i]);
        ViewBasis lb = bases.items[uint(light_layers[i])];
        light_p[i] = project(lb, p);
        light_c[i] = vec4(project(lb, c), light_layers[i]);
        light_d[i] = project(lb, l);
    }
    mat4 shadow = v.cascade_from_world[min(cascade_of(t), MAX_CASCADES - 1u)];
    shadow_p = (shadow * vec4(position, 1.0)).xyz;
    shadow_c = vec4(shadow[3].xyz, (shadow * vec4(v.sun_direction, 0.0)).z);
    // A texel spans crowns whose backs slope by about one: half a texel towards the sun, or neighbours shade each other's rims.
    float bias = 0.5 * v.cascade_texel[min(cascade_of(t), MAX_CASCADES - 1u)] * shadow_c.w;
    shadow_p.z += bias;
    shadow_c.z += bias;
    weights = vec4(t.view_weights, t.light_weights);
    // The model's metres: what is in a crown grows with it.
    float phase_angle = angle_between(-t.centre, v.sun_direction);
    if (WIND) toward = normalize(toward);
    sun_from = vec4(toward, transfer_strength(sqrt(phase_angle)));
    optics = vec4(t.mip, kind.extinction * phase_angle / t.scale, t.fade, c.z);
    vec2 hole = unpackHalf2x16(t.hole_change), weight = unpackHalf2x16(t.own_lit), lit = unpackHalf2x16(t.mean_lit_change);
    sun = vec4(t.sun, hole.x);
    sky = vec4(t.sky, plane.half_extent.z);
    uvec3 row = masks.items[hash(t.identity ^ HASH_MASK) % MASK_ROWS].xyz;
    tree_bits = uvec4(row, cascade_of(t) | (below ? 16u : 0u) | species_row(t.species) << 5u | caster_name(t.identity) << 8u | (t.mean_lit_change & 0xffff0000u));
    handed = uvec4(0u);
    handed_sky = uvec2(0u);
    if (INDIRECT) {
        HandedLight h = handed_light.items[index];
        handed = uvec4(h.sun, h.sky);
        handed_sky = h.open;
    }
    bark_ratio = vec4(kind.bark_ratio, kind.bare_below);
    mean_sun = vec4(t.mean_sun, weight.x);
    mean_sky = vec4(t.mean_sky, lit.x);
    own = vec4(tree_dither(t.identity, v.dither_turn), kind.leaf_shadow * sqrt(phase_angle), weight.y, hole.y);
}
