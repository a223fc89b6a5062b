// A quad around one tree that faces the sun, in one cascade; the layer is chosen here.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_ARB_shader_viewport_layer_array : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/zfield.glsl"
#include "frame/trees/zfield_space.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(std430, binding = 1) readonly buffer Trees { Tree items[]; } trees;
layout(std430, binding = 2) readonly buffer Lists { uint items[]; } lists;
layout(std140, binding = 3) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 4) readonly buffer Bases { ViewBasis items[]; } bases;
layout(push_constant) uniform Push { uint cascade; };
layout(constant_id = 0) const int VIEW_RINGS = 9;
layout(constant_id = 1) const float VIEW_RESOLUTION = 256.0;

layout(location = 0) out vec3 light_p[3];
layout(location = 3) out float depth;
layout(location = 4) flat out vec4 light_d[3]; // w: layer
layout(location = 7) flat out vec4 optics;     // weights of two views, mip, opacity factor
layout(location = 8) flat out float depth_per_metre;
layout(location = 9) flat out uint dither;

void main() {
    View v = view.v;
    Tree t = trees.items[lists.items[gl_VertexIndex >> 2]];
    Species kind = species.items[t.species];
    vec3 half_extent = kind.scale_to_metres * t.scale;
    vec3 l = (tree_rotation(t) * v.sun_direction) / half_extent;
    vec3 w = normalize(l), right, up;
    frame_across(w, right, up);
    float mip = clamp(floor(log2(VIEW_RESOLUTION * v.cascade_texel[cascade] /
                                 (2.0 * max(half_extent.x, half_extent.z))) + 0.5), 0.0, log2(VIEW_RESOLUTION));
    vec3 layers = unpack_layers(t.light_layers, kind.first_layer);
    vec4 extent = tree_bounds(bases.items[uint(layers.x)].bounds, bases.items[uint(layers.y)].bounds,
                              bases.items[uint(layers.z)].bounds, w, false, VIEW_RINGS);
    vec2 margin = exp2(mip) / VIEW_RESOLUTION * vec2(1.0, length(w.xy) + w.z);
    vec3 p = right * ((gl_VertexIndex & 1) == 0 ? extent.x - margin.x : extent.y + margin.x) +
             up * ((gl_VertexIndex & 2) == 0 ? extent.z - margin.y : extent.w + margin.y);
    mat4 shadow = v.cascade_from_world[cascade];
    vec4 at = shadow * vec4(world_from_tree(t, kind, p), 1.0);
    for (int i = 0; i < 3; i++) {
        ViewBasis b = bases.items[uint(layers[i])];
        light_p[i] = project(b, p);
        light_d[i] = vec4(project(b, l), layers[i]);
    }
    depth = at.z;
    depth_per_metre = (shadow * vec4(v.sun_direction, 0.0)).z;
    optics = vec4(t.light_weights, mip, t.fade);
    dither = hash(t.identity ^ HASH_DITHER ^ cascade);
    // Trees before the cascade's near side cast from there: the fragment writes their depth.
    gl_Position = vec4(at.xy, 0.5, 1.0);
    gl_Layer = int(cascade);
}
