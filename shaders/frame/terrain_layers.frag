// The ground: sun and sky part apart, no tree.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/ground.glsl"

layout(location = 0) out vec4 sun_part;
layout(location = 1) out vec4 sky_part;
layout(location = 2) out uint species;

void main() {
    vec3 sun, sky;
    ground_light(sun, sky);
    sun_part = vec4(sun, 1.0);
    sky_part = vec4(sky, 0.0);
    species = 0u;
}
