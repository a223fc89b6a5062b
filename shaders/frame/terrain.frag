// The ground: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/ground.glsl"

layout(location = 0) out vec4 radiance;

void main() {
    vec3 sun, sky;
    ground_light(sun, sky);
    radiance = vec4(sun + sky, 1.0);
}
