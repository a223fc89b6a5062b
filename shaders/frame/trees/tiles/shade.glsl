// Light on each pixel's distinct trees, once each, and what their samples and the ground's make of the pixel. One workgroup a tile.
//
// Every invocation lists the trees of its column of pixels; then the tile's list is shaded by all invocations in turn, so that
// none waits for pixels that see no tree; then each puts its pixels together.
#include "physics/hash.glsl"
#include "physics/light.glsl"
#include "physics/correction.glsl"
#include "frame/trees/tiles/fetch.glsl"
#include "physics/zfield.glsl"
#include "physics/shadow.glsl"
#include "physics/transfer.glsl"
#include "physics/indirect.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/trees/zfield_light.glsl"
#include "frame/camera.glsl"
#include "frame/trees/tiles/box.glsl"
#include "frame/view_mode.glsl"
#include "frame/trees/zfield_mode.glsl"
#include "frame/shown.glsl"
#include "frame/tile.glsl"

layout(local_size_x = 8) in;
layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 1) uniform usamplerBuffer trees;
layout(binding = 2) uniform usamplerBuffer ranked; // tree | draw << 30
layout(std140, binding = 3) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(binding = 4) uniform samplerBuffer bases;
layout(binding = 7) uniform usamplerBuffer seen;
layout(binding = 8) uniform sampler2DArray views;
layout(binding = 9) uniform sampler2DArray shadow_map;
layout(binding = 10) uniform sampler2DArray transfer_1;
layout(binding = 11) uniform sampler2DArray transfer_2;
layout(binding = 12) uniform usamplerBuffer handed_light;
layout(push_constant) uniform Push { TileParameters p; };
layout(constant_id = 0) const uint SAMPLES = 4u;
layout(constant_id = 1) const uint ESTIMATES = 1u;
layout(constant_id = 2) const int LIGHT_ITERATIONS = 1;
layout(constant_id = 3) const bool HAS_SUN = true;
layout(constant_id = 4) const uint TRANSFER_BANDS = 0u;
layout(constant_id = 5) const bool INDIRECT = false;
layout(constant_id = 6) const uint TRANSFER_LEVELS = 1u; // by which its texels are larger than the views'

// What a tree shows to a pixel that sees it, and how deep; `offset` is the pixel's from the image's centre.
Shown shade(uint rank, vec2 offset, out float depth) {
    View v = view.v;
    uint who = texelFetch(ranked, int(rank)).x, draw = who >> 30u;
    Tree t = fetch_tree(trees, who & 0x3fffffffu);
    Species kind = species.items[species_row(t.species)];
    TreePlane plane = tree_plane(t, kind);
    Camera camera = camera_of(v, vec2(p.size));
    vec3 direction = ray_through(camera, offset);
    // The eye c, and the ray's point on the plane through the centre, in tree space.
    vec3 q = to_tree(plane, direction), c = plane.far * plane.w;
    vec3 point = c - q * (plane.far / dot(plane.w, q));

    bool below = t.view_layers >> 31u != 0u;
    vec3 layers = unpack_layers(t.view_layers, kind.first_layer);
    vec3 light_layers = unpack_layers(t.light_layers, kind.first_layer);
    vec3 at[3], to[3];
    for (int k = 0; k < 3; k++) {
        ViewBasis b = fetch_basis(bases, uint(layers[k]));
        at[k] = project(b, point);
        to[k] = project(b, c) - at[k];
    }
    bool magnified = draw == 0u;
    uint before = draw < 2u ? ESTIMATES : 0u;
    Surface surface = zfield_search(views, at, to, layers, vec3(t.view_weights, 1.0 - t.view_weights.x - t.view_weights.y), t.mip,
                                    magnified ? 0u : before, magnified ? before : 0u, below);
    float s = clamp(surface.s, -1e3, 0.999);
    vec3 found = mix(point, c, s), toward = resting(t, v.sun_direction);
    vec3 metre = toward / plane.half_extent;
    if (WIND) toward = normalize(toward);
    vec3 world = world_from_tree(t, kind, found);
    depth = min(v.clip_from_world[3].z / max(dot(camera.forward, world), 1e-6), 1.0);
    LightRay ray;
    for (int k = 0; k < 3; k++) {
        ViewBasis b = fetch_basis(bases, uint(light_layers[k]));
        ray.from[k] = project(b, found);
        ray.metre[k] = project(b, metre);
    }
    ray.layers = light_layers;
    ray.weights = vec3(t.light_weights, 1.0 - t.light_weights.x - t.light_weights.y);
    uint cascade = min(cascade_of(t), MAX_CASCADES - 1u);
    mat4 shadow = cascade_matrix(v, cascade, ray.turn);
    ray.entry = (shadow * vec4(world, 1.0)).xyz;
    ray.deeper = (shadow * vec4(v.sun_direction, 0.0)).z;
    // A texel spans crowns whose backs slope by about one: half a texel towards the sun, or neighbours shade each other's rims.
    ray.entry.z += 0.5 * v.cascade_texel[cascade] * ray.deeper;
    float phase_angle = angle_between(-t.centre, v.sun_direction), root = sqrt(phase_angle);
    vec2 hole = unpackHalf2x16(t.hole_change), own = unpackHalf2x16(t.own_lit), lit = unpackHalf2x16(t.mean_lit_change);
    HandedLight handed = nothing_handed();
    if (INDIRECT) handed = fetch_handed(handed_light, who & 0x3fffffffu);
    TreeLight light = TreeLight(t.sun, hole.y, t.sky, t.mean_sun, t.mean_sky, lit.x, own.x, vec2(own.y, lit.y), kind.bark_ratio,
                                kind.bare_below, plane.half_extent.z, hole.x, kind.leaf_shadow * root, kind.extinction * phase_angle / t.scale, toward,
                                transfer_strength(root), cascade_of(t), caster_name(t.identity), uvec4(handed.sun, handed.sky), handed.open);
    TreeParts parts = tree_light(views, shadow_map, transfer_1, transfer_2, light, surface, at, to, layers, below, t.mip, magnified,
                                 s, found.z, ray, LightQuality(HAS_SUN, INDIRECT, LIGHT_ITERATIONS, TRANSFER_BANDS, float(TRANSFER_LEVELS)));
#ifdef LAYERS
    return Shown(vec4(parts.sun, 1.0), vec4(parts.sky, 1.0), vec4(0.0, 0.0, parts.lit, 1.0 - parts.lit));
#else
    if (VIEW_MODE != 0u) return Shown(vec4(tree_mode(draw == 1u && ESTIMATES == 0u ? 2u : draw, cascade_of(t), parts.lit), 1.0));
    return Shown(vec4(parts.sun + parts.sky, 1.0));
#endif
}

// Species of a tree.
uint species_of(uint rank) {
    uint tree = texelFetch(ranked, int(rank)).x & 0x3fffffffu;
    return species_row(texelFetch(trees, int(tree) * 8 + 1).z);
}

uint sample_sees(ivec2 pixel, int k) { return texelFetch(seen, int((pixel.y * int(p.size.x) + pixel.x) * int(SAMPLES)) + k).x; }

#include "frame/trees/distinct.glsl"

#ifdef LAYERS
shared float depths[8u * MOST_ITEMS];
#endif

void main() {
    uvec2 corner = tile_corner();
    uint column = gl_LocalInvocationIndex;
    list_items(corner, column);
    barrier();
    uint total = item_count();
    for (uint i = column; i < total; i += 8u) {
        uint slot = item_slot(i, MOST_ITEMS);
        float depth;
        // From the image's centre.
        vec2 offset = vec2(item_pixel(corner, slot)) + 0.5 - 0.5 * vec2(p.size);
        shown[slot] = shade(ranks[slot] - 1u, offset, depth);
#ifdef LAYERS
        depths[slot] = depth;
#endif
    }
    barrier();
    uint item = column * MOST_ITEMS, end = item + counts[column];
    for (uint row = 0u; row < TILE_SIDE; row++) {
        uint covered, first;
        Shown all = row_shown(row, end, item, covered, first);
        ivec2 pixel = ivec2(corner + uvec2(column, row));
        // What the others of its samples see is there. Where every sample sees a tree, nothing is yet.
        if (covered != 0u && covered + 1u != 1u << SAMPLES) all = sum(all, load_pixel(pixel));
        if (covered != 0u) store_pixel(pixel, all);
#ifdef LAYERS
        if (first != ~0u) store_first(pixel, species_of(ranks[first] - 1u) + 1u, depths[first]);
#endif
    }
}
