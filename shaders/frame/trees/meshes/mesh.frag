// The triangle of a mesh that a sample sees, where it is no hole.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/masks.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 6) uniform sampler2DArray masks;
layout(constant_id = 0) const uint SAMPLES = 4u;
layout(location = 0) in vec2 uv;
layout(location = 1) flat in uvec4 what;
layout(location = 0) out uint seen;

// What of a pixel a mask leaves. Its texels are opacities, with the material's cutoff at a half; of coarser levels, shares that are no
// hole. Where a texel is larger than a pixel the edge stays a pixel wide.
float opacity(vec2 across, vec2 down) {
    float side = float(textureSize(masks, 0).x);
    float level = 0.5 * log2(max(max(dot(across, across), dot(down, down)), 1e-12)) + log2(side) + view.v.footprint;
    float here = textureLod(masks, vec3(uv, float(what.z)), max(floor(level + 0.5), 0.0)).r;
    return clamp((here - 0.5) * max(exp2(-level), 1.0) + 0.5, 0.0, 1.0);
}

void main() {
    vec2 across = dFdx(uv), down = dFdy(uv);
    uint all = (1u << SAMPLES) - 1u, some = all;
    if (what.z != NO_PAGE) some = mesh_mask(covered_samples(opacity(across, down), unit(what.w), SAMPLES), what.w, SAMPLES);
    seen = what.x;
    gl_SampleMask[0] = int(some & what.y);
}
