// The triangle of a mesh that a sample sees, where it is no hole.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/masks.glsl"
#include "frame/trees/meshes/opacity.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 6) uniform sampler2DArray masks;
layout(constant_id = 0) const uint SAMPLES = 4u;
layout(location = 0) in vec2 uv;
layout(location = 1) flat in uvec4 what;
layout(location = 0) out uint seen;

void main() {
    float opacity = mask_opacity(masks, uv, dFdx(uv), dFdy(uv), what.z, view.v.footprint);
    uint some = mesh_mask(covered_samples(opacity, unit(what.w), SAMPLES), what.w, SAMPLES);
    seen = what.x;
    gl_SampleMask[0] = int(some & what.y);
}
