// An antialiased disc; blending makes the union of discs.
#version 450

layout(location = 0) in vec2 from_centre;
layout(location = 1) flat in float radius;
layout(location = 0) out vec4 coverage;

void main() {
    // A disc under a texel keeps its area.
    float edge = clamp(radius + 0.5 - length(from_centre), 0.0, 1.0);
    float covered = radius >= 0.5 ? edge : edge * min(4.0 * radius * radius, 1.0);
    coverage = vec4(covered, 0.0, 0.0, 0.0);
}
