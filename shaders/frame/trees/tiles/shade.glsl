// Light on each pixel's distinct trees, once each, and what their samples and the ground's make of the pixel. One workgroup a tile.
//
// Every invocation lists the trees of its column of pixels; then the tile's list is shaded by all invocations in turn, so that
// none waits for pixels that see no tree; then each puts its pixels together.
#include "physics/hash.glsl"
#include "physics/light.glsl"
#include "frame/trees/tiles/fetch.glsl"
#include "physics/zfield.glsl"
#include "physics/shadow.glsl"
#include "physics/transfer.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/trees/zfield_light.glsl"
#include "frame/camera.glsl"
#include "frame/trees/tiles/box.glsl"

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
layout(push_constant) uniform Push { TileParameters p; };
layout(constant_id = 0) const uint SAMPLES = 4u;
layout(constant_id = 1) const uint ESTIMATES = 1u;
layout(constant_id = 2) const int LIGHT_ITERATIONS = 1;
layout(constant_id = 3) const bool HAS_SUN = true;
layout(constant_id = 4) const uint TRANSFER_BANDS = 0u;

const uint MOST_ITEMS = TILE_SIDE * 8u; // trees of a column: one a sample, of up to eight

struct Shaded {
    TreeParts parts;
    uint species;   // counted from 1
    uint draw;
    uint cascade;
};

// A tree's light where a pixel sees it; `offset` is the pixel's from the image's centre.
Shaded shade(uint rank, vec2 offset) {
    View v = view.v;
    uint who = texelFetch(ranked, int(rank)).x, draw = who >> 30u;
    Tree t = fetch_tree(trees, who & 0x3fffffffu);
    Species kind = species.items[t.species];
    TreePlane plane = tree_plane(t, kind);
    Camera camera = camera_of(v, vec2(p.size));
    vec3 direction = camera.forward + offset.x * camera.right + offset.y * camera.down;
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
    vec3 found = mix(point, c, s), toward = to_tree(TreePlane(vec3(1.0), plane.turn, plane.w, plane.far, plane.right, plane.up, vec4(0.0)), v.sun_direction);
    vec3 metre = toward / plane.half_extent;
    LightRay ray;
    for (int k = 0; k < 3; k++) {
        ViewBasis b = fetch_basis(bases, uint(light_layers[k]));
        ray.from[k] = project(b, found);
        ray.metre[k] = project(b, metre);
    }
    ray.layers = light_layers;
    ray.weights = vec3(t.light_weights, 1.0 - t.light_weights.x - t.light_weights.y);
    uint cascade = min(t.cascade, MAX_CASCADES - 1u);
    mat4 shadow = v.cascade_from_world[0];
    for (uint k = 1u; k < MAX_CASCADES; k++) {
        if (k == cascade) shadow = v.cascade_from_world[k];
    }
    ray.entry = (shadow * vec4(world_from_tree(t, kind, found), 1.0)).xyz;
    ray.deeper = (shadow * vec4(v.sun_direction, 0.0)).z;
    // A texel spans crowns whose backs slope by about one: half a texel towards the sun, or neighbours shade each other's rims.
    ray.entry.z += 0.5 * v.cascade_texel[cascade] * ray.deeper;
    float phase_angle = angle_between(-t.centre, v.sun_direction), root = sqrt(phase_angle);
    TreeLight light = TreeLight(t.sun, t.sky, t.mean_sun, t.mean_sky, t.mean_lit, t.own, kind.bark_ratio, kind.bare_below,
                                plane.half_extent.z, t.hole, kind.leaf_shadow * root, kind.extinction * phase_angle / t.scale, toward,
                                transfer_strength(root), t.cascade);
    Shaded shaded;
    shaded.parts = tree_light(views, shadow_map, transfer_1, transfer_2, light, surface, at, to, layers, below, t.mip, magnified, s,
                              found.z, ray, LightQuality(HAS_SUN, LIGHT_ITERATIONS, TRANSFER_BANDS));
    shaded.species = t.species + 1u;
    shaded.draw = draw;
    shaded.cascade = t.cascade;
    return shaded;
}

shared uint ranks[8u * MOST_ITEMS];  // the trees of each column
shared uint places[8u * MOST_ITEMS]; // samples that see them; row of the pixel << 8
shared uint counts[8];

// Lists the trees of this invocation's column.
void list_items(uvec2 corner, uint column) {
    uint count = 0u, first_item = column * MOST_ITEMS;
    for (uint row = 0u; row < TILE_SIDE; row++) {
        uvec2 pixel = corner + uvec2(column, row);
        bool inside = pixel.x < p.size.x && pixel.y < p.size.y;
        int at = int((min(pixel.y, p.size.y - 1u) * p.size.x + min(pixel.x, p.size.x - 1u)) * SAMPLES);
        uint tree[8];
        for (uint k = 0u; k < SAMPLES; k++) tree[k] = inside ? texelFetch(seen, at + int(k)).x : 0u;
        for (uint k = 0u; k < SAMPLES; k++) {
            bool first = tree[k] != 0u;
            uint samples = 0u;
            for (uint i = 0u; i < SAMPLES; i++) {
                first = first && (i >= k || tree[i] != tree[k]);
                samples |= tree[i] == tree[k] ? 1u << i : 0u;
            }
            if (first) {
                ranks[first_item + count] = tree[k] - 1u;
                places[first_item + count] = samples | row << 8u;
                count++;
            }
        }
    }
    counts[column] = count;
}

// Where item i of the tile is, counted column after column; its column is slot / MOST_ITEMS. Beyond the last: ~0.
uint item_slot(uint i) {
    uint slot = ~0u, before = 0u;
    for (uint c = 0u; c < 8u; c++) {
        uint count = counts[c];
        if (i >= before && i < before + count) slot = c * MOST_ITEMS + i - before;
        before += count;
    }
    return slot;
}

// The pixel of an item, from the image's centre.
vec2 item_offset(uvec2 corner, uint slot) {
    return vec2(corner + uvec2(slot / MOST_ITEMS, places[slot] >> 8u)) + 0.5 - 0.5 * vec2(p.size);
}
