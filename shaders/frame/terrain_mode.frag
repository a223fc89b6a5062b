// The ground in a view mode.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/terrain_point.glsl"
#include "frame/view_mode.glsl"
#include "frame/ground_mode.glsl"

layout(location = 0) out vec4 colour;

void main() {
    GroundPoint at = ground_point();
    vec3 n = ground_normal(at.slope_at, at.layer);
    colour = vec4(ground_mode(at, ground_light(at, n), n), 1.0);
}
