// Trees over ground drawn with several samples a pixel: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(binding = 13) uniform sampler2DMSArray ground;

vec3 ground_colour(ivec2 pixel, int k) { return texelFetch(ground, ivec3(pixel, 0), k).rgb; }

#include "frame/trees/tiles/shade_radiance.glsl"
