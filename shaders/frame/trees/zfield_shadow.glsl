// A quad around one tree that faces the sun, in one block of a cascade; where LAYERED the layer is chosen here.
#include "physics/zfield.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(std430, binding = 1) readonly buffer Casters { Caster items[]; } casters;
layout(std140, binding = 3) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 4) readonly buffer Bases { ViewBasis items[]; } bases;
layout(push_constant) uniform Push { ShadowBlock block; };
layout(constant_id = 0) const int VIEW_RINGS = 9;
layout(constant_id = 1) const float VIEW_RESOLUTION = 256.0;

layout(location = 0) out vec3 light_p[3];
layout(location = 3) out float depth;
layout(location = 4) flat out vec4 light_d[3]; // w: layer
layout(location = 7) flat out vec3 optics;     // weights of two views, mip
layout(location = 8) flat out float depth_per_metre;
layout(location = 9) flat out uint dither;

void main() {
    Caster t = casters.items[gl_VertexIndex >> 2];
    Species kind = species.items[species_row(t.species)];
    vec3 half_extent = kind.scale_to_metres * t.scale;
    vec3 l = unswayed(t.species, rotation_back(t.turn) * view.v.sun_direction) / half_extent;
    vec3 w = normalize(l), right, up;
    frame_across(w, right, up);
    vec3 layers = unpack_layers(t.light_layers, kind.first_layer);
    vec4 extent = tree_bounds(bases.items[uint(layers.x)].bounds, bases.items[uint(layers.y)].bounds,
                              bases.items[uint(layers.z)].bounds, w, false, VIEW_RINGS);
    vec2 margin = exp2(t.mip) / VIEW_RESOLUTION * vec2(1.0, length(w.xy) + w.z);
    vec3 p = right * ((gl_VertexIndex & 1) == 0 ? extent.x - margin.x : extent.y + margin.x) +
             up * ((gl_VertexIndex & 2) == 0 ? extent.z - margin.y : extent.w + margin.y);
    vec3 m = rotated(t.turn, swayed(t.species, p * half_extent));
    vec3 at = t.place + vec3(dot(block.x, m), dot(block.y, m), dot(block.z, m));
    for (int i = 0; i < 3; i++) {
        ViewBasis b = bases.items[uint(layers[i])];
        light_p[i] = project(b, p);
        light_d[i] = vec4(project(b, l), layers[i]);
    }
    depth = at.z;
    depth_per_metre = block.depth_per_metre;
    optics = vec3(t.light_weights, t.mip);
    dither = t.dither;
    // Trees before the cascade's near side cast from there: the fragment writes their depth.
    gl_Position = vec4(at.xy * block.to_clip - 1.0, 0.5, 1.0);
#ifdef LAYERED
    gl_Layer = int(block.cascade);
#endif
}
