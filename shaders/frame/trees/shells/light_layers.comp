// Slices of a forest where they are seen, of several samples a pixel: parts of the light apart.
#version 450
#extension GL_GOOGLE_include_directive : require
#define LAYERS
#include "interface.glsl"
#include "frame/trees/shells/light.glsl"
