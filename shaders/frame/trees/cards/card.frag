// The card of a cloud that a sample sees, where it is no hole.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "frame/samples.glsl"
#include "frame/trees/cards/card.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 6) uniform sampler2DArray opacities; // a species a layer
layout(constant_id = 0) const uint SAMPLES = 4u;
layout(location = 0) in vec2 texel;
layout(location = 1) in vec2 at;
layout(location = 2) flat in uvec4 what;
layout(location = 3) flat in float least;
layout(location = 0) out uint seen;

void main() {
    // Each sample stands for a square of 1/sqrt(SAMPLES) pixels a side, and looks at that much of the picture around itself. Texels of the finest
    // level are opacities, of which a half is the edge; of others, shares of the finest that are no hole. Even opacity covers as many samples as
    // it is of all: their thresholds are evenly spaced.
    vec2 across = dFdx(texel), down = dFdy(texel), x = dFdx(at), y = dFdy(at);
    float level = 0.5 * log2(max(max(dot(across, across), dot(down, down)), 1e-12)) + view.v.footprint - 0.5 * log2(float(SAMPLES));
    float whole = clamp(floor(level + 0.5), 0.0, float(CARD_LEVELS - 1u)), sharp = max(exp2(-level), 1.0);
    vec2 scale = 1.0 / vec2(textureSize(opacities, 0).xy);
    uint some = 0u;
    for (uint k = 0u; k < SAMPLES; k++) {
        vec2 offset = sample_offset(k, SAMPLES);
        float here = textureLod(opacities, vec3((texel + offset.x * across + offset.y * down) * scale, float(what.z)), whole).r;
        float opacity = clamp((here - 0.5) * sharp + 0.5, 0.0, 1.0), threshold = fract(unit(what.w) + float(k) / float(SAMPLES));
        bool fades = opacity * card_gauss(at + offset.x * x + offset.y * y) < least;
        some |= opacity > threshold && !fades ? 1u << k : 0u;
    }
    seen = what.x;
    gl_SampleMask[0] = int(some & what.y);
}
