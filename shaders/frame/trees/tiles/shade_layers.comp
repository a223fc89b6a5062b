// Light on the trees that samples see: its parts apart.
#version 450
#extension GL_GOOGLE_include_directive : require
#define LAYERS
#include "interface.glsl"
#include "frame/trees/tiles/shade.glsl"
