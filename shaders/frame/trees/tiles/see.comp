// The tree that each sample sees, before ground drawn with several samples a pixel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(binding = 8) uniform sampler2DMSArray ground;

float ground_depth(ivec2 pixel, int k) { return texelFetch(ground, ivec3(pixel, 0), k).r; }

#include "frame/trees/tiles/see.glsl"
