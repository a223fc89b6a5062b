// The triangle of a mesh that a sample sees, where it is no hole.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "frame/samples.glsl"
#include "frame/trees/meshes/opacity.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 6) uniform sampler2DArray masks;
layout(constant_id = 0) const uint SAMPLES = 4u;
layout(location = 0) in vec2 uv;
layout(location = 1) flat in uvec4 what;
layout(location = 0) out uint seen;

void main() {
    // Each sample stands for a square of 1/sqrt(SAMPLES) pixels a side, and looks at that much of the mask around itself: needles that are
    // thinner than a pixel are then sharp, and what is seen of a card is what there is of it. Even opacity covers as many samples as
    // it is of all: their thresholds are evenly spaced.
    vec2 across = dFdx(uv), down = dFdy(uv);
    float wider = view.v.footprint - 0.5 * log2(float(SAMPLES));
    uint some = 0u;
    for (uint k = 0u; k < SAMPLES; k++) {
        vec2 offset = sample_offset(k, SAMPLES);
        float opacity = mask_opacity(masks, uv + offset.x * across + offset.y * down, across, down, what.z, wider);
        float threshold = fract(unit(what.w) + float(k) / float(SAMPLES));
        some |= opacity > threshold ? 1u << k : 0u;
    }
    seen = what.x;
    gl_SampleMask[0] = int(some & what.y);
}
