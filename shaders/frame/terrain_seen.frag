// The quad of terrain that a sample sees, counted from 1.
#version 450

layout(location = 0) flat in uint quad;
layout(location = 0) out uint seen_quad;

void main() { seen_quad = quad; }
