// The sky: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/camera.glsl"
#include "frame/sky.glsl"

layout(location = 0) out vec4 radiance;

void main() { radiance = vec4(sky_radiance(), 0.0); }
