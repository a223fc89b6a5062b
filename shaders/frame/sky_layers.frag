// The sky: all of it is sky part.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/camera.glsl"
#include "frame/sky.glsl"

layout(location = 0) out vec4 sun_part;
layout(location = 1) out vec4 sky_part;
layout(location = 2) out uint species;
layout(location = 3) out vec4 fractions;

void main() {
    sun_part = vec4(0.0);
    sky_part = vec4(sky_radiance(), 0.0);
    species = 0u;
    fractions = vec4(0.0);
}
