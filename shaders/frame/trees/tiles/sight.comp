// The record of every tree in view, front to back, its box on the screen, and how many lists it goes into.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/trees/tiles/order.glsl"
#include "frame/trees/tiles/sight.glsl"
#include "frame/camera.glsl"
#include "frame/trees/tiles/box.glsl"

layout(local_size_x = 64) in;
layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 1) uniform usamplerBuffer trees;
layout(std430, binding = 2) readonly buffer Lists { uint items[]; } lists;
layout(std140, binding = 3) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(binding = 4) uniform samplerBuffer bases;
layout(std430, binding = 5) readonly buffer Masks { uvec4 items[]; } masks;
layout(std430, binding = 6) readonly buffer Commands { DrawCommand items[]; } commands;
layout(std430, binding = 7) readonly buffer Keys { uint items[]; } keys;
layout(std430, binding = 8) readonly buffer Order { uint items[]; } order;
layout(std430, binding = 9) readonly buffer State { TileState items[]; } state;
layout(std430, binding = 10) writeonly buffer Records { uvec4 items[]; } records;
layout(std430, binding = 11) writeonly buffer Boxes { uvec2 items[]; } boxes;
layout(std430, binding = 12) writeonly buffer Spans { uint items[]; } spans;
layout(std430, binding = 13) writeonly buffer Ranked { uint items[]; } ranked; // tree | draw << 30
layout(push_constant) uniform Push { TileParameters p; };
layout(constant_id = 0) const int VIEW_RINGS = 9;
layout(constant_id = 1) const float VIEW_RESOLUTION = 256.0;
layout(constant_id = 2) const uint MASK_ROWS = 12u;
layout(constant_id = 3) const uint SAMPLES = 4u;

// A row of the mask table less its first column, which is empty, and its last, which is full.
uvec2 inner_columns(uvec3 row) {
    return uvec2(row.x >> SAMPLES | row.y << (32u - SAMPLES), row.y >> SAMPLES | row.z << (32u - SAMPLES));
}

// Which of the camera's draws a place of its list is in.
uint draw_of(uint place) {
    uint first = 0u, draw = 0u;
    for (uint k = 0u; k < CAMERA_DRAWS - 1u; k++) {
        first += commands.items[k].index_count / 6u;
        draw += place >= first ? 1u : 0u;
    }
    return draw;
}

void main() {
    uint rank = gl_GlobalInvocationID.x;
    if (rank >= state.items[0].tree_count) return;
    View v = view.v;
    uint place = order.items[rank], index = lists.items[place];
    Tree t = fetch_tree(trees, index);
    Species kind = species.items[species_row(t.species)];
    TreePlane plane = tree_plane(t, kind);
    vec3 layers = unpack_layers(t.view_layers, kind.first_layer);
    ViewBasis around[3];
    for (int k = 0; k < 3; k++) around[k] = fetch_basis(bases, uint(layers[k]));
    plane.extent = quad_extent(plane, t.mip, around[0].bounds, around[1].bounds, around[2].bounds,
                               t.view_layers >> 31u != 0u, VIEW_RINGS, VIEW_RESOLUTION);
    Camera camera = camera_of(v, vec2(p.size));

    Sight s;
    s.extent = plane.extent;
    // A point of the plane before the camera: the centre, or where that lies behind, the farthest corner.
    vec2 at = vec2(0.0);
    float deepest = dot(camera.forward, t.centre), reach = 0.1 * length(plane.half_extent);
    for (uint c = 0u; c < 4u && dot(camera.forward, t.centre) < reach; c++) {
        vec2 corner = vec2((c & 1u) == 0u ? plane.extent.x : plane.extent.y, (c & 2u) == 0u ? plane.extent.z : plane.extent.w);
        float depth = dot(camera.forward, world_from_tree(t, kind, plane.right * corner.x + plane.up * corner.y));
        if (depth > deepest) {
            deepest = depth;
            at = corner;
        }
    }
    uvec4 box = uvec4(0u);
    s.pixel = vec2(0.0);
    s.tilt = vec2(0.0);
    s.across = vec4(0.0);
    s.start = at;
    s.depth = deepest;
    s.mesh = near_count(t);
    if (deepest > 0.0 && t.fade > 0.0 && s.mesh < SAMPLES) {
        vec3 point = t.centre + (at == vec2(0.0) ? vec3(0.0) : world_from_tree(t, kind, plane.right * at.x + plane.up * at.y) - t.centre);
        vec3 ray = point / deepest;
        s.pixel = vec2(dot(ray, camera.x), dot(ray, camera.y)) + 0.5 * vec2(p.size);
        vec3 q = to_tree(plane, ray), qx = to_tree(plane, camera.right), qy = to_tree(plane, camera.down);
        float facing = dot(plane.w, q);
        s.tilt = vec2(dot(plane.w, qx), dot(plane.w, qy)) / facing;
        s.across = deepest * vec4(dot(plane.right, qx), dot(plane.right, qy), dot(plane.up, qx), dot(plane.up, qy));
        box = screen_box(t, kind, plane, camera, p.size);
    }
    s.weights = t.view_weights;
    s.layers = t.view_layers;
    s.first = kind.first_layer;
    s.mip = uint(t.mip);
    s.draw = draw_of(place);
    s.bin = keys.items[place];
    s.fade = t.fade;
    for (int k = 0; k < 3; k++) {
        ViewBasis b = around[k];
        s.right[k] = project(b, plane.right);
        s.up[k] = project(b, plane.up);
        s.toward[k] = project(b, plane.w);
    }
    s.closeness = 1.0 / plane.far;
    s.dither = tree_dither(t.identity, v.dither_turn);
    s.row = inner_columns(masks.items[hash(t.identity ^ HASH_MASK) % MASK_ROWS].xyz);
    for (uint k = 0u; k < SIGHT_TEXELS; k++) records.items[rank * SIGHT_TEXELS + k] = sight_words(s, k);
    ranked.items[rank] = index | s.draw << 30u;
    bool empty = box.z <= box.x || box.w <= box.y;
    boxes.items[rank] = empty ? uvec2(0u) : uvec2(box.x | box.y << 16u, box.z | box.w << 16u);
    uvec4 in_lists = box_lists(box, p.list_shift);
    spans.items[rank] = 1u + (empty ? 0u : (in_lists.z - in_lists.x) * (in_lists.w - in_lists.y));
}
