// Corners of the meshes of a species' trees.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/masks.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/trees/meshes/seen.glsl"
#include "frame/trees/meshes/corner.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 1) uniform usamplerBuffer trees;
layout(std430, binding = 2) readonly buffer Draws { MeshDraw items[]; } draws;
layout(std430, binding = 3) readonly buffer MeshTrees { uint items[]; } mesh_trees;
layout(binding = 4) uniform usamplerBuffer corners;
layout(binding = 5) uniform usamplerBuffer faces;
layout(std140, binding = 7) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(push_constant) uniform Push { uint drawn; };
layout(constant_id = 0) const uint SAMPLES = 4u;

layout(location = 0) out vec2 uv;
layout(location = 1) flat out uvec4 what; // what samples see; in which samples; layer of the mask; dither of the mask's opacity

void main() {
    MeshDraw d = draws.items[drawn];
    uint place = d.first_tree + uint(gl_InstanceIndex), face = uint(gl_VertexIndex) / 3u;
    Tree t = fetch_tree(trees, mesh_trees.items[place]);
    uvec4 corner = texelFetch(corners, gl_VertexIndex), is = texelFetch(faces, int(face));
    vec3 at = corner_place(corner);
    if (WIND) at = blown(motion_of(view.v), t.species, caster_name(t.identity), is, species.items[species_row(t.species)].scale_to_metres, at);
    gl_Position = view.v.clip_from_world * vec4(world_from_model(t, at), 1.0);
    uv = corner_uv(corner);
    uint dither = uint(unit(hash(t.identity ^ HASH_DITHER)) * 1024.0);
    uint mask = mesh_mask(mesh_count(t), dither, SAMPLES);
    what = uvec4(mesh_seen(place, face - d.first_face), mask, is.x, hash2(t.identity, face));
}
