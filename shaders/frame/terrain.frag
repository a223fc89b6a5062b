// The ground: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/ground.glsl"

layout(location = 0) out vec4 radiance;

void main() {
    GroundLight g = ground_light();
    radiance = vec4(g.sun + g.sky, 1.0);
}
