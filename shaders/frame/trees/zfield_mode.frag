// A z-field tree in a view mode.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/zfield_shade.glsl"
#include "frame/view_mode.glsl"
#include "frame/trees/zfield_mode.glsl"

layout(location = 0) out vec4 colour;

void main() {
    vec3 sun_part, sky_part;
    float lit;
    shade(sun_part, sky_part, lit);
    // The coverage is the ground's: trees would hide it.
    if (VIEW_MODE == MODE_COVERAGE) gl_SampleMask[0] = 0;
    colour = vec4(tree_mode(CONVERGED ? 3u : MAGNIFIED ? 0u : ESTIMATES > 0u ? 1u : 2u, tree_bits.w & 15u, lit), 1.0);
}
