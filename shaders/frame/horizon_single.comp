// The sky and far trees before it, of one sample a pixel: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#define SINGLE
#include "interface.glsl"
#include "frame/horizon.glsl"
