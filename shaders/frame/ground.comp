// The ground where it is seen, of several samples a pixel: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(binding = 10) uniform sampler2DMSArray depth;
layout(binding = 11) uniform usampler2DMSArray quads_seen;

float ground_depth(ivec2 pixel, int k) { return texelFetch(depth, ivec3(pixel, 0), k).r; }
uint ground_quad(ivec2 pixel, int k) { return texelFetch(quads_seen, ivec3(pixel, 0), k).r; }

#include "frame/ground_radiance.glsl"
