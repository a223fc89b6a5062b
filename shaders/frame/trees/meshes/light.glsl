// Light on meshes where samples see them, once a pixel and triangle: by the crown around its leaf (BBP08, section 4), or by the spherical harmonics of
// how light comes to it (BCF05, section 4).
#include "physics/hash.glsl"
#include "physics/light.glsl"
#include "physics/shadow.glsl"
#include "physics/leaf.glsl"
#include "physics/harmonics.glsl"
#include "physics/forest_sky.glsl"
#include "physics/received.glsl"
#include "physics/correction.glsl"
#include "physics/indirect.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/surfaces_seen.glsl"
#include "frame/trees/meshes/corner.glsl"
#include "frame/camera.glsl"
#include "frame/samples.glsl"
#include "frame/view_mode.glsl"
#include "frame/trees/zfield_mode.glsl"
#include "frame/shown.glsl"
#include "frame/tile.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 1) uniform usamplerBuffer trees;
layout(std140, binding = 2) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 3) readonly buffer Kinds { MeshKind items[]; } kinds;
layout(std430, binding = 4) readonly buffer MeshTrees { MeshTree items[]; } mesh_trees;
layout(binding = 5) uniform usamplerBuffer corners;
layout(binding = 6) uniform usamplerBuffer faces;
layout(binding = 8) uniform usamplerBuffer envelopes;
layout(std140, binding = 9) uniform Leaves { vec4 items[2u * 26u]; } rule;
layout(binding = 15) uniform usamplerBuffer handed_light;
layout(binding = 14) uniform samplerBuffer hiding;    // of each direction, HIDING_STEPS pairs
layout(push_constant) uniform Push { MeshLightParameters p; };
layout(constant_id = 1) const bool HAS_SUN = true;
layout(constant_id = 2) const uint LEAF_DIRECTIONS = 26u;
layout(constant_id = 3) const int LEAF_POWER = 6;
layout(constant_id = 4) const bool INDIRECT = false;
layout(constant_id = 6) const bool HARMONICS = false;
layout(binding = 16) uniform sampler2DArray forest_sky; // zonal harmonics of what a forest leaves of the sky, by height and thickness

#include "frame/trees/near_sun.glsl"
#include "frame/trees/seen_sun.glsl"

// What the crown leaves of sky and sun at a triangle of unit normal n, all in the tree's own axes; and of the sky, what the trees around leave
// of thickness `around`, at a height above the ground in metres (src/bake/hiding.rs).
LeafLight leaf_light(uint face, vec3 n, vec3 viewer, vec3 sun, float height, float around) {
    const uint words = (LEAF_DIRECTIONS + 7u) / 8u;
    LeafLight light = LeafLight(vec2(0.0), 0.0);
    vec2 sides = vec2(0.0);
    float towards = 0.0, step = clamp(height, 0.0, 0.999 * p.heights.x) * p.heights.y;
    for (uint word = 0u; word < words; word++) {
        // Around what is seen of it from above, and from below.
        uvec4 w = texelFetch(envelopes, int(2u * face * words + word)), u = texelFetch(envelopes, int((2u * face + 1u) * words + word));
        for (uint k = 0u; k < 8u && 8u * word + k < LEAF_DIRECTIONS; k++) {
            uvec2 pair = k < 2u ? uvec2(w.x, u.x) : k < 4u ? uvec2(w.y, u.y) : k < 6u ? uvec2(w.z, u.z) : uvec2(w.w, u.w);
            uint at = 2u * (8u * word + k);
            vec2 both = mix(unpackHalf2x16(pair.y), unpackHalf2x16(pair.x), 0.5 + 0.5 * viewer.z), hides = texelFetch(hiding, int((8u * word + k) * HIDING_STEPS) + int(step)).xy;
            float others = exp(-around * (hides.x + fract(step) * hides.y));
            leaf_direction(light, sides, towards, rule.items[at], rule.items[at + 1u].xyz, others, (k & 1u) == 0u ? both.x : both.y, n, sun,
                           LEAF_POWER);
        }
    }
    return leaf_means(light, sides, towards, n);
}

// What a triangle receives; `front` says whether the side of its normal is seen.
Received face_received(uint face, bool front, vec3 sun, vec3 zonal) {
    float c[24];
    for (int word = 0; word < 3; word++) {
        uvec4 w = texelFetch(envelopes, 3 * int(face) + word);
        for (int k = 0; k < 4; k++) {
            vec2 pair = unpackHalf2x16(w[k]);
            c[8 * word + 2 * k] = pair.x;
            c[8 * word + 2 * k + 1] = pair.y;
        }
    }
    Received r = received(float[](c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]),
                          float[](c[9], c[10], c[11], c[12], c[13], c[14], c[15], c[16], c[17]), sun, zonal);
    return front ? r : Received(r.sun.yx, r.sky.yx);
}

// What a triangle shows to a pixel, at a place of the world from the camera.
Shown shade(uint what, vec3 world) {
    View v = view.v;
    uint index = mesh_trees.items[seen_tree(what)].tree;
    Tree t = fetch_tree(trees, index);
    uint row = species_row(t.species);
    Species kind = species.items[row];
    uint face = kinds.items[row].first_face + seen_triangle(what);
    mat3 back = tree_rotation(t);
    vec3 a = corner_place(texelFetch(corners, int(3u * face))), viewer = back * normalize(-world), sun = back * v.sun_direction;
    vec3 b = corner_place(texelFetch(corners, int(3u * face + 1u))), c = corner_place(texelFetch(corners, int(3u * face + 2u)));
    uvec4 is = texelFetch(faces, int(face));
    if (WIND) {
        Motion m = motion_of(v);
        uint name = caster_name(t.identity);
        a = blown(m, t.species, name, is, kind.scale_to_metres, a);
        b = blown(m, t.species, name, is, kind.scale_to_metres, b);
        c = blown(m, t.species, name, is, kind.scale_to_metres, c);
    }
    vec3 n = normalize(cross(b - a, c - a));
    bool leaf = is_leaf(is);
    bool front = !leaf || dot(n, viewer) >= 0.0;
    // Bark has one side, that which is seen.
    if (!leaf && dot(n, viewer) < 0.0) n = -n;
    vec3 reflectance = optics.items[OPTICS * row + (leaf ? 0u : 2u)].rgb, transmittance = leaf ? optics.items[OPTICS * row + 1u].rgb : vec3(0.0);
    vec2 hole = unpackHalf2x16(t.hole_change), own = unpackHalf2x16(t.own_lit), lit = unpackHalf2x16(t.mean_lit_change);
    float above_middle = (back * (world - t.centre)).z, height = above_middle / (kind.scale_to_metres.z * t.scale);
    HandedLight handed = nothing_handed();
    if (INDIRECT) handed = fetch_handed(handed_light, index);
    float above = above_middle + kind.centre * t.scale, around = hole.x / max(kind.hole, 1e-9) * kind.mean_area;
    vec3 sky = tint_of(t) * view.v.sky_radiance, sky_seen, sun_seen;
    float own_part = 1.0;
    if (HARMONICS) {
        vec3 zonal = textureLod(forest_sky, vec3(sky_place(above / p.heights.x, around), 0.0), 0.0).xyz;
        Received light = face_received(face, front, sun, zonal);
        sky_seen = (reflectance * light.sky.x + transmittance * light.sky.y) / PI;
        vec3 over = seen_sun(row, 0u, viewer, sun, height);
        sun_seen = (reflectance * ((leaf ? over.x : over.z) * light.sun.x) + transmittance * (over.y * light.sun.y)) / PI;
    } else {
        LeafLight light = leaf_light(face, n, viewer, sun, above, around);
        sky_seen = leaf_sky(reflectance, transmittance, n, viewer, light.sky);
        sun_seen = leaf_sun(reflectance, transmittance, n, viewer, sun);
        own_part = light.sun;
    }
    vec3 sky_part = own.x * sky_seen * sky + t.mean_sky, sun_part = t.mean_sun;
    float lit_part = 0.0;
    if (HAS_SUN) {
        // A cascade into which meshes cast tells single leaves apart, and knows the own tree's as well; another knows the other trees, by
        // their z-fields, and the envelope is the own tree's shadow. Harmonics have it always.
        bool leaves = !HARMONICS && cascade_of(t) < v.mesh_cascades;
        float visible = sun_left(t, kind, world, rotated(t.turn, n), own_part, leaves);
        lit_part = min(own.x * visible + lit.x, 1.0);
        sun_part += (own.x * visible * tint_of(t)) * sun_seen * v.sun_irradiance;
    }
    if (INDIRECT) {
        vec3 of_leaves = leaf ? vec3(1.0) : kind.bark_ratio;
        sun_part += handed_at(handed.sun, height) * of_leaves;
        sky_part += handed_at(handed.sky, height) * of_leaves;
    }
#ifdef LAYERS
    return Shown(vec4(sun_part, 1.0), vec4(sky_part, 1.0), vec4(0.0, 0.0, lit_part, 1.0 - lit_part));
#else
    if (VIEW_MODE != 0u) return Shown(vec4(tree_mode(MESH_DRAW, cascade_of(t), lit_part), 1.0));
    return Shown(vec4(sun_part + sky_part, 1.0));
#endif
}

bool is_mine(uint what) { return is_mesh(what); }
// The ground's light is there before.
bool is_stored(uint what) { return is_ground(what); }
uint species_seen(uint what) { return 1u + species_row(texelFetch(trees, int(mesh_trees.items[seen_tree(what)].tree) * 8 + 1).z); }

#include "frame/trees/near_pixels.glsl"
