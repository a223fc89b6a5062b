// Light on the trees that samples see: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/tiles/shade_radiance.glsl"
