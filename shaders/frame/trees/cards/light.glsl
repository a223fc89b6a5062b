// Light on cards where samples see them, once a pixel and card: the transfer of what is painted there, as spherical harmonics of where light comes
// from, against the light (Behrendt et al. 2005, section 4; Sloan et al. 2002).
#include "physics/hash.glsl"
#include "physics/light.glsl"
#include "physics/shadow.glsl"
#include "physics/harmonics.glsl"
#include "physics/forest_sky.glsl"
#include "physics/received.glsl"
#include "physics/correction.glsl"
#include "physics/indirect.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/surfaces_seen.glsl"
#include "frame/trees/cards/card.glsl"
#include "frame/camera.glsl"
#include "frame/samples.glsl"
#include "frame/view_mode.glsl"
#include "frame/trees/zfield_mode.glsl"
#include "frame/shown.glsl"
#include "frame/tile.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 1) uniform usamplerBuffer trees;
layout(std140, binding = 2) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 3) readonly buffer Kinds { CardKind items[]; } kinds;
layout(binding = 4) uniform usamplerBuffer cards;
layout(binding = 5) uniform sampler2DArray surfaces;  // a species a layer: share of leaves, depth before the card
layout(binding = 6) uniform sampler2DArray transfers; // five layers a species
layout(binding = 8) uniform sampler2DArray forest_sky; // zonal harmonics of what a forest leaves of the sky, by height and thickness
layout(binding = 15) uniform usamplerBuffer handed_light;
layout(push_constant) uniform Push { CardLightParameters p; };
layout(constant_id = 1) const bool HAS_SUN = true;
layout(constant_id = 4) const bool INDIRECT = false;

#include "frame/trees/near_sun.glsl"
#include "frame/trees/seen_sun.glsl"

const uint TRANSFER_LAYERS = 5u; // of four coefficients each: nine of what the seen side receives, then nine of the other

// `texel` is the atlas' own, whose transfers have half as many along a side.
Received card_received(vec2 texel, uint row, vec3 sun, vec3 zonal) {
    vec2 at = texel / vec2(2 * textureSize(transfers, 0).xy);
    vec4 c[TRANSFER_LAYERS];
    for (uint k = 0u; k < TRANSFER_LAYERS; k++) c[k] = TRANSFER_SCALE * textureLod(transfers, vec3(at, float(TRANSFER_LAYERS * row + k)), 0.0);
    return received(float[](c[0].x, c[0].y, c[0].z, c[0].w, c[1].x, c[1].y, c[1].z, c[1].w, c[2].x),
                    float[](c[2].y, c[2].z, c[2].w, c[3].x, c[3].y, c[3].z, c[3].w, c[4].x, c[4].y), sun, zonal);
}

// A normal of the side that a picture shows, in axes to its right, up and to its viewer, from the octahedron's upper half.
vec3 painted_normal(vec2 stored) {
    vec2 at = 2.0 * stored - 1.0;
    return vec3(at, max(1.0 - abs(at.x) - abs(at.y), 0.0));
}

// What a card shows to a pixel, at a place of the world from the camera.
Shown shade(uint what, vec3 world) {
    View v = view.v;
    uint index = card_tree(what);
    Tree t = fetch_tree(trees, index);
    uint row = species_row(t.species);
    Species kind = species.items[row];
    bool far_form = card_of(what) >= kinds.items[row].full_count;
    Card c = fetch_card(cards, kinds.items[row].first_card + card_of(what));
    vec3 place = resting(t, world - t.centre) / t.scale - c.centre, toward = card_normal(c);
    vec2 at = clamp(vec2(dot(place, c.right) / dot(c.right, c.right), dot(place, c.up) / dot(c.up, c.up)), -1.0, 1.0);
    bool behind = seen_from_behind(c, resting(t, -t.centre) / t.scale);
    vec2 texel = card_texel(c, at, behind);
    // Texels of the atlas a pixel, at this distance.
    float texels = float(c.size >> 16u) / (2.0 * length(c.up) * t.scale) * length(world) / v.pixels_at_1m;
    float level = clamp(floor(log2(max(texels, 1e-6)) + 0.5), 0.0, float(CARD_LEVELS - 1u));
    vec4 surface = textureLod(surfaces, vec3(texel / vec2(textureSize(surfaces, 0).xy), float(row)), level);
    // Where what is painted there was, before the card.
    vec3 out_of = behind ? -toward : toward, moved = out_of * ((2.0 * surface.y - 1.0) * c.depth), found = c.centre + place + moved;
    world += rotated(t.turn, moved * t.scale);
    float height = found.z / kind.scale_to_metres.z, share = surface.x;
    vec2 hole = unpackHalf2x16(t.hole_change), own = unpackHalf2x16(t.own_lit), lit = unpackHalf2x16(t.mean_lit_change);
    float around = hole.x / max(kind.hole, 1e-9) * kind.mean_area, above = (found.z + kind.centre) * t.scale;
    vec3 zonal = textureLod(forest_sky, vec3(sky_place(above * p.top.y, around), 0.0), 0.0).xyz;
    mat3 back = tree_rotation(t);
    vec3 sun = back * v.sun_direction;
    Received light = card_received(texel, row, sun, zonal);
    // A leaf that the card shows from one side shows the other to who looks at the card askew.
    vec3 n = painted_normal(surface.zw);
    n = normalize(c.right) * n.x + normalize(c.up) * n.y + out_of * n.z;
    if (share > 0.5 && dot(n, resting(t, -world)) < 0.0) light = Received(light.sun.yx, light.sky.yx);
    vec3 bark = (1.0 - share) * optics.items[OPTICS * row + 2u].rgb / PI, reflectance = share * optics.items[OPTICS * row].rgb / PI;
    vec3 transmittance = share * optics.items[OPTICS * row + 1u].rgb / PI;
    HandedLight handed = nothing_handed();
    if (INDIRECT) handed = fetch_handed(handed_light, index);
    vec3 tint = vec3(tint_of(t));
    vec3 sky_part = own.x * ((reflectance + bark) * light.sky.x + transmittance * light.sky.y) * tint * v.sky_radiance + t.mean_sky;
    vec3 sun_part = t.mean_sun;
    float lit_part = 0.0;
    if (HAS_SUN) {
        // The own tree's shadow is in the transfer.
        float visible = sun_left(t, kind, world, v.sun_direction, 1.0, false);
        lit_part = min(own.x * visible + lit.x, 1.0);
        vec3 over = seen_sun(row, far_form ? 1u : 0u, back * normalize(-world), sun, height);
        vec3 sun_seen = (over.x * reflectance + over.z * bark) * light.sun.x + (over.y * transmittance) * light.sun.y;
        sun_part += (own.x * visible) * tint * sun_seen * v.sun_irradiance;
    }
    if (INDIRECT) {
        vec3 of_leaves = mix(kind.bark_ratio, vec3(1.0), share);
        sun_part += handed_at(handed.sun, height) * of_leaves;
        sky_part += handed_at(handed.sky, height) * of_leaves;
    }
#ifdef LAYERS
    return Shown(vec4(sun_part, 1.0), vec4(sky_part, 1.0), vec4(0.0, 0.0, lit_part, 1.0 - lit_part));
#else
    if (VIEW_MODE != 0u) return Shown(vec4(tree_mode(far_form ? FAR_FORM_DRAW : CARD_DRAW, cascade_of(t), lit_part), 1.0));
    return Shown(vec4(sun_part + sky_part, 1.0));
#endif
}

bool is_mine(uint what) { return is_card(what); }
// The light of the ground and of meshes is there before.
bool is_stored(uint what) { return !is_card(what) && !is_shell(what); }
uint species_seen(uint what) { return 1u + species_row(texelFetch(trees, int(card_tree(what)) * 8 + 1).z); }

#include "frame/trees/near_pixels.glsl"
