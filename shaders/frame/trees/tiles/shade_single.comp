// Trees over ground drawn with one sample a pixel: radiance. A pixel is a tree's or the ground's.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

vec3 ground_colour(ivec2 pixel, int k) { return vec3(0.0); }

#include "frame/trees/tiles/shade_radiance.glsl"
