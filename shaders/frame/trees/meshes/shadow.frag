// Depth at which a mesh stops the sun's light. A texel is there or not: with the probability of the mask's opacity, and the same in every
// frame, because the map is world-fixed and so is what is drawn to it.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/shadow.glsl"
#include "frame/trees/meshes/opacity.glsl"

layout(binding = 6) uniform sampler2DArray masks;
layout(location = 0) in vec2 uv;
layout(location = 1) in float depth;
layout(location = 2) flat in uvec3 what;

void main() {
    float opacity = mask_opacity(masks, uv, dFdx(uv), dFdy(uv), what.x, 0.0);
    uvec2 at = uvec2(gl_FragCoord.xy);
    if (opacity <= unit(what.y + at.x * 3242174889u + at.y * 2447445413u)) discard;
    gl_FragDepth = named_depth(clamp(depth, 0.0, 1.0), what.z);
}
