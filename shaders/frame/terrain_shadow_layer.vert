// Squares of ground in a cascade, drawn to its layer alone.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/terrain_shadow.glsl"
