// The ground where it is seen, of one sample a pixel: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(binding = 10) uniform sampler2DArray depth;
layout(binding = 11) uniform usampler2DArray quads_seen;

float ground_depth(ivec2 pixel, int k) { return texelFetch(depth, ivec3(pixel, 0), 0).r; }
uint ground_quad(ivec2 pixel, int k) { return texelFetch(quads_seen, ivec3(pixel, 0), 0).r; }

#include "frame/ground_radiance.glsl"
