// A z-field tree: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/zfield_shade.glsl"

layout(location = 0) out vec4 radiance;

void main() {
    vec3 sun_part, sky_part;
    float lit;
    shade(sun_part, sky_part, lit);
    radiance = vec4(sun_part + sky_part, 1.0);
}
