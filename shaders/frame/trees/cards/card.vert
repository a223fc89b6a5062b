// Corners of the cards of trees that are clouds of them: of the full clouds, or of the far forms.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/masks.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/trees/near_seen.glsl"
#include "frame/trees/cards/card.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 1) uniform usamplerBuffer trees;
layout(std430, binding = 2) readonly buffer Kinds { CardKind items[]; } kinds;
layout(std430, binding = 3) readonly buffer Lists { uint items[]; } lists;
layout(std430, binding = 4) readonly buffer Starts { uint items[]; } starts;
layout(binding = 5) uniform usamplerBuffer cards;
layout(std140, binding = 7) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(push_constant) uniform Push { CardParameters p; };
layout(constant_id = 0) const uint SAMPLES = 4u;

layout(location = 0) out vec2 texel;
layout(location = 1) out vec2 at;
layout(location = 2) flat out uvec4 what;  // what samples see; in which samples; species; dither of the opacity
layout(location = 3) flat out float least; // of opacity times the Gaussian

// Corners of two triangles, anticlockwise.
const vec2 CORNERS[6] = vec2[](vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0));

void main() {
    bool far_form = p.far_form != 0u;
    uint first = far_form && p.far_bins < DISTANCE_BINS ? starts.items[1u + p.far_bins] : 0u;
    uint tree = lists.items[first + uint(gl_InstanceIndex)];
    Tree t = fetch_tree(trees, tree);
    uint row = species_row(t.species);
    CardKind kind = kinds.items[row];
    Species s = species.items[row];
    uint own = uint(gl_VertexIndex) / 6u, card = own + (far_form ? kind.full_count : 0u);
    float pixels = view.v.pixels_at_1m * 2.0 * s.scale_to_metres.z * t.scale / max(length(t.centre), 1e-6);
    float between = between_forms(pixels, p.fade_pixels);
    uint bits = uint(tree_dither(t.identity, view.v.dither_turn) * 1024.0);
    uint mask = mesh_mask(near_count(t), bits, SAMPLES) & ~mesh_mask(mesh_count(t), bits, SAMPLES);
    bool drawn = mask != 0u && own < (far_form ? kind.far_count : kind.full_count) && (far_form ? between > 0.0 : between < 1.0);
    Card c = fetch_card(cards, kind.first_card + (drawn ? card : 0u));
    vec3 eye = resting(t, -t.centre) / t.scale;
    bool behind = seen_from_behind(c, eye);
    at = CORNERS[uint(gl_VertexIndex) % 6u];
    vec3 place = c.centre + c.right * at.x + c.up * at.y;
    gl_Position = view.v.clip_from_world * vec4(t.centre + rotated(t.turn, swayed(t.species, place * t.scale)), 1.0);
    // What is not drawn is nowhere.
    if (!drawn) gl_Position = vec4(0.0, 0.0, 0.5, 1.0);
    texel = card_texel(c, at, behind);
    what = uvec4(card_seen(tree, card), mask, row, hash2(t.identity, card) + view.v.dither_turn);
    least = fade_threshold(between, far_form);
    // The level card, the last of the far form, is for eyes above and below: to others its edge would be a stick across the crown.
    if (far_form && own + 1u == kind.far_count) least = max(least, 1.0 - smoothstep(0.2, 0.5, abs(eye.z) / max(length(eye), 1e-6)));
}
