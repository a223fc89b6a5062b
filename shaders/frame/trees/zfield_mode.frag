// A z-field tree in a view mode.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/zfield_shade.glsl"
#include "frame/view_mode.glsl"

layout(location = 0) out vec4 colour;

void main() {
    vec3 sun_part, sky_part;
    float lit;
    shade(sun_part, sky_part, lit);
    // Normals of the ellipsoid that stands for the crown are no better than none: trees are grey.
    vec3 shown = vec3(0.5);
    if (VIEW_MODE == MODE_FRACTIONS) shown = fractions_colour(vec4(0.0, 0.0, lit, 1.0 - lit));
    // The coverage is the ground's: trees would hide it.
    if (VIEW_MODE == MODE_COVERAGE) gl_SampleMask[0] = 0;
    if (VIEW_MODE == MODE_LOD) {
        // Not one expression: Mesa 22.3 selects only the first component of vectors by a specialization constant.
        shown = vec3(0.95, 0.85, 0.1);
        if (ESTIMATES > 0u) shown = vec3(0.95, 0.45, 0.05);
        if (MAGNIFIED) shown = vec3(0.9, 0.1, 0.1);
        if (CONVERGED) shown = vec3(0.1, 0.7, 0.2);
    }
    if (VIEW_MODE == MODE_CASCADES) {
        uint cascade = tree_bits.w & 15u;
        shown = cascade_colour(cascade, cascade < MAX_CASCADES ? lit : 1.0);
    }
    colour = vec4(shown, 1.0);
}
