// Height and slope of the ground at an array of positions: tests compare with src/physics/terrain.rs.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "physics/terrain.glsl"

struct Position {
    ivec2 cell;
    vec2 f;
};

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Positions { Position items[]; } positions;
layout(std430, binding = 1) writeonly buffer Results { vec4 items[]; } results;
layout(binding = 2) uniform sampler2DArray heights;
layout(push_constant) uniform Push { uint count; };

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= count) return;
    results.items[k] = vec4(height_and_slope(heights, positions.items[k].cell, positions.items[k].f), 0.0);
}
