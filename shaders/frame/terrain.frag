// The ground: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/terrain_point.glsl"

layout(location = 0) out vec4 radiance;

void main() {
    GroundPoint at = ground_point();
    GroundLight g = ground_light(at, ground_normal(at.slope_at, at.layer));
    radiance = vec4(g.sun + g.sky, 1.0);
}
