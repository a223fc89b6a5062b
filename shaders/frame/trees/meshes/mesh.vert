// Corners of a tree that is a mesh.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/masks.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/trees/near_seen.glsl"
#include "frame/trees/meshes/corner.glsl"
#include "physics/levels.glsl"
#include "frame/trees/meshes/level.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 1) uniform usamplerBuffer trees;
layout(std430, binding = 2) readonly buffer Kinds { MeshKind items[]; } kinds;
layout(std430, binding = 3) readonly buffer MeshTrees { MeshTree items[]; } mesh_trees;
layout(binding = 4) uniform usamplerBuffer corners;
layout(binding = 5) uniform usamplerBuffer faces;
layout(push_constant) uniform Push { uint first; }; // tree of the first draw
layout(constant_id = 0) const uint SAMPLES = 4u;

layout(location = 0) out vec2 uv;
layout(location = 1) flat out uvec4 what; // what samples see; in which samples; layer of the mask; dither of the mask's opacity

void main() {
    uint place = first + uint(gl_InstanceIndex), face = uint(gl_VertexIndex) / 3u;
    MeshTree shown = mesh_trees.items[place];
    Tree t = fetch_tree(trees, shown.tree);
    uint row = species_row(t.species);
    uvec4 corner = texelFetch(corners, gl_VertexIndex), is = texelFetch(faces, int(face));
    vec3 at = corner_place(corner), box = kinds.items[row].half_box;
    // A leaf turns about its own middle before its card is moved to where fewer stand for all.
    if (WIND) at = turned_leaf(motion_of(view.v), caster_name(t.identity), is, box, at);
    at = levelled(at, is, shown, box, kinds.items[row].leaf_middle);
    if (WIND) at = carried(motion_of(view.v), t.species, caster_name(t.identity), is, box, at);
    gl_Position = view.v.clip_from_world * vec4(world_from_model(t, at), 1.0);
    uv = corner_uv(corner);
    uint dither = uint(tree_dither(t.identity, view.v.dither_turn) * 1024.0);
    uint mask = mesh_mask(mesh_count(t), dither, SAMPLES);
    uint triangle = face - kinds.items[row].first_face;
    what = uvec4(mesh_seen(place, triangle), mask, is.x, hash2(t.identity, kinds.items[row].first_name + triangle) + view.v.dither_turn);
}
