// Corners of the meshes that cast into a block of a cascade whose texels tell leaves apart; where LAYERED the layer is chosen here. All species
// are drawn together, with as many corners as the largest has: of others the rest is nowhere. Casters are whole: maps are kept from frame to frame, and who casts
// into them does not depend on where the camera is, so neither may what is drawn of it.
#include "physics/hash.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/trees/meshes/corner.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(std430, binding = 1) readonly buffer Casters { Caster items[]; } casters;
layout(std430, binding = 2) readonly buffer Kinds { MeshKind items[]; } kinds;
layout(binding = 4) uniform usamplerBuffer corners;
layout(binding = 5) uniform usamplerBuffer faces;
layout(push_constant) uniform Push {
    ShadowBlock block;
    uint first_caster;
};

layout(location = 0) out vec2 uv;
layout(location = 1) out float depth;
layout(location = 2) flat out uvec3 what; // layer of the mask, dither of its opacity, name

void main() {
    Caster t = casters.items[first_caster + uint(gl_InstanceIndex)];
    uint row = species_row(t.species), first_face = kinds.items[row].first_face;
    uint face = uint(gl_VertexIndex) / 3u;
    bool is = face < kinds.items[row].face_count;
    uvec4 corner = texelFetch(corners, int(3u * first_face) + (is ? gl_VertexIndex : 0));
    uvec4 triangle = texelFetch(faces, int(first_face + (is ? face : 0u)));
    vec3 place = corner_place(corner);
    if (WIND) place = blown(motion_of(view.v), t.species, t.dither & 255u, triangle, kinds.items[row].half_box, place);
    vec3 m = rotated(t.turn, place * t.scale);
    vec3 at = t.place + vec3(dot(block.x, m), dot(block.y, m), dot(block.z, m));
    uv = corner_uv(corner);
    depth = at.z;
    what = uvec3(triangle.x, t.dither + face * 2654435769u, t.dither);
    // What is before the cascade's near side casts from there: the fragment writes its depth.
    gl_Position = is ? vec4(at.xy * block.to_clip - 1.0, 0.5, 1.0) : vec4(0.0, 0.0, 0.5, 1.0);
#ifdef LAYERED
    gl_Layer = int(block.cascade);
#endif
}
