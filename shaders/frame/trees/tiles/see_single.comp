// The tree that each pixel sees, before ground drawn with one sample a pixel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(binding = 8) uniform sampler2DArray ground;

float ground_depth(ivec2 pixel, int k) { return texelFetch(ground, ivec3(pixel, 0), 0).r; }

#include "frame/trees/tiles/see.glsl"
