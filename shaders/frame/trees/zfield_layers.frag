// A z-field tree: sun and sky part apart, coverage in the sky part's fourth channel, species, fractions.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/zfield_shade.glsl"

layout(location = 0) out vec4 sun_layer;
layout(location = 1) out vec4 sky_layer;
layout(location = 2) out uint species_layer;
layout(location = 3) out vec4 fractions; // lit and shadowed ground, lit and shadowed trees

void main() {
    vec3 sun_part, sky_part;
    float lit;
    species_layer = shade(sun_part, sky_part, lit);
    fractions = vec4(0.0, 0.0, lit, 1.0 - lit);
    sun_layer = vec4(sun_part, 1.0);
    sky_layer = vec4(sky_part, 1.0);
}
