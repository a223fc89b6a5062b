// Light on meshes where samples see them, once a pixel and triangle (BBP08, section 4). One workgroup a tile of 8 x 8 pixels, as for
// z-fields: every invocation lists what its column of pixels sees; all light the list in turn; each puts its pixels together.
#include "physics/hash.glsl"
#include "physics/light.glsl"
#include "physics/shadow.glsl"
#include "physics/leaf.glsl"
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

layout(local_size_x = 8) in;
layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 1) uniform usamplerBuffer trees;
layout(std140, binding = 2) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 3) readonly buffer Kinds { MeshKind items[]; } kinds;
layout(std430, binding = 4) readonly buffer MeshTrees { MeshTree items[]; } mesh_trees;
layout(binding = 5) uniform usamplerBuffer corners;
layout(binding = 6) uniform usamplerBuffer faces;
layout(binding = 7) uniform usamplerBuffer seen;      // z-field trees, which are before what meshes show
layout(binding = 8) uniform usamplerBuffer envelopes;
layout(std140, binding = 9) uniform Leaves { vec4 items[2u * 26u]; } rule;
layout(std140, binding = 12) uniform Optics { vec4 items[3u * MAX_SPECIES]; } optics; // of each species: reflectance and transmittance of leaves, bark
layout(binding = 13) uniform sampler2DArray shadow_map;
layout(binding = 15) uniform usamplerBuffer handed_light;
layout(binding = 14) uniform samplerBuffer hiding;    // of each direction, HIDING_STEPS pairs
layout(push_constant) uniform Push { MeshLightParameters p; };
layout(constant_id = 0) const uint SAMPLES = 4u;
layout(constant_id = 1) const bool HAS_SUN = true;
layout(constant_id = 2) const uint LEAF_DIRECTIONS = 26u;
layout(constant_id = 3) const int LEAF_POWER = 6;
layout(constant_id = 4) const bool INDIRECT = false;

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

// What is left of the sun at a place of unit normal n, of which `own` is what its own crown leaves on average. Each tree's shadow counts once:
// a cascade into which meshes cast tells single leaves apart, and knows its own tree's as well; another knows the other trees, by their
// z-fields, and the envelope is the own tree's shadow.
float sun_left(Tree t, Species kind, vec3 world, vec3 n, float own) {
    View v = view.v;
    uint cascade = min(cascade_of(t), MAX_CASCADES - 1u);
    vec2 turn;
    mat4 shadow = cascade_matrix(v, cascade, turn);
    vec3 at = (shadow * vec4(world, 1.0)).xyz;
    float deeper = (shadow * vec4(v.sun_direction, 0.0)).z;
    // Half a texel towards the sun, so that nothing shades itself.
    at.z += 0.5 * v.cascade_texel[cascade] * deeper;
    bool leaves = cascade_of(t) < v.mesh_cascades;
    float reach = 4.0 * kind.scale_to_metres.z * t.scale * deeper;
    vec3 facing = dot(n, v.sun_direction) < 0.0 ? -n : n;
    vec2 gradient = leaves ? plane_gradient(facing, v.cascade_x, v.cascade_y, v.sun_direction) : vec2(0.0);
    float visible = sun_visibility(shadow_map, at, gradient, turn, cascade, leaves ? ON_MESH : caster_name(t.identity), leaves ? 0.0 : reach);
    return (leaves ? 1.0 : own) * (cascade_of(t) < MAX_CASCADES ? visible : 1.0);
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
    // Bark has one side, that which is seen.
    if (!leaf && dot(n, viewer) < 0.0) n = -n;
    vec3 reflectance = optics.items[3u * row + (leaf ? 0u : 2u)].rgb, transmittance = leaf ? optics.items[3u * row + 1u].rgb : vec3(0.0);
    vec2 hole = unpackHalf2x16(t.hole_change), own = unpackHalf2x16(t.own_lit), lit = unpackHalf2x16(t.mean_lit_change);
    float above_middle = (back * (world - t.centre)).z, height = above_middle / (kind.scale_to_metres.z * t.scale);
    HandedLight handed = nothing_handed();
    if (INDIRECT) handed = fetch_handed(handed_light, index);
    LeafLight light = leaf_light(face, n, viewer, sun, above_middle + kind.centre * t.scale, hole.x / max(kind.hole, 1e-9) * kind.mean_area);
    vec3 sky = tint_of(t) * view.v.sky_radiance;
    vec3 sky_part = own.x * leaf_sky(reflectance, transmittance, n, viewer, light.sky) * sky + t.mean_sky;
    vec3 sun_part = t.mean_sun;
    float lit_part = 0.0;
    if (HAS_SUN) {
        float visible = sun_left(t, kind, world, rotated(t.turn, n), light.sun);
        lit_part = min(own.x * visible + lit.x, 1.0);
        sun_part += (own.x * visible * tint_of(t)) * leaf_sun(reflectance, transmittance, n, viewer, sun) * v.sun_irradiance;
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

uint sample_sees(ivec2 pixel, int k) {
    uint tree = texelFetch(seen, int((pixel.y * int(p.size.x) + pixel.x) * int(SAMPLES)) + k).x;
    uint what = surface_seen(pixel, k);
    return tree == 0u && is_mesh(what) ? what : 0u;
}

// Whether a sample of a pixel sees the ground or the sky, so that something is there already.
bool sees_past(ivec2 pixel) {
    bool past = false;
    for (uint k = 0u; k < SAMPLES; k++) {
        uint tree = texelFetch(seen, int((pixel.y * int(p.size.x) + pixel.x) * int(SAMPLES) + int(k))).x;
        past = past || (tree == 0u && !is_mesh(surface_seen(pixel, int(k))));
    }
    return past;
}

#include "frame/trees/distinct.glsl"

// The mean place of samples of a pixel.
vec3 place_of(ivec2 pixel, uint samples) {
    Camera camera = camera_of(view.v, vec2(p.size));
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < SAMPLES; k++) {
        vec2 offset = vec2(pixel) + 0.5 + sample_offset(k, SAMPLES) - 0.5 * vec2(p.size);
        float deep = view.v.clip_from_world[3].z / max(surface_depth(pixel, int(k)), 1e-30);
        sum += (samples >> k & 1u) != 0u ? deep * ray_through(camera, offset) : vec3(0.0);
    }
    return sum / float(bitCount(samples));
}

void main() {
    uvec2 corner = tile_corner();
    uint column = gl_LocalInvocationIndex;
    list_items(corner, column);
    barrier();
    uint total = item_count();
    for (uint i = column; i < total; i += 8u) {
        uint slot = item_slot(i, MOST_ITEMS);
        shown[slot] = shade(ranks[slot], place_of(item_pixel(corner, slot), places[slot] & 0xffu));
    }
    barrier();
    uint item = column * MOST_ITEMS, end = item + counts[column];
    for (uint row = 0u; row < TILE_SIDE; row++) {
        uint covered, first;
        Shown all = row_shown(row, end, item, covered, first);
        ivec2 pixel = ivec2(corner + uvec2(column, row));
        if (covered != 0u && sees_past(pixel)) all = sum(all, load_pixel(pixel));
        if (covered != 0u) store_pixel(pixel, all);
#ifdef LAYERS
        if (first != ~0u) {
            uint kind = species_row(texelFetch(trees, int(mesh_trees.items[seen_tree(ranks[first])].tree) * 8 + 1).z);
            store_first(pixel, kind + 1u, surface_depth(pixel, 0));
        }
#endif
    }
}
