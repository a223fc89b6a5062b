// Slices of a forest where they are seen, of one sample a pixel: radiance, or a view mode.
#version 450
#extension GL_GOOGLE_include_directive : require
#define SINGLE
#include "interface.glsl"
#include "frame/trees/shells/light.glsl"
