// The ground: sun and sky part apart, what of it is trees in the sky part's fourth channel, fractions.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/terrain_point.glsl"

layout(location = 0) out vec4 sun_part;
layout(location = 1) out vec4 sky_part;
layout(location = 2) out uint species_layer;
layout(location = 3) out vec4 fractions;

void main() {
    GroundPoint at = ground_point();
    GroundLight g = ground_light(at, ground_normal(at.slope_at, at.layer));
    sun_part = vec4(g.sun, 1.0);
    sky_part = vec4(g.sky, g.trees);
    species_layer = 0u;
    fractions = g.fractions;
}
