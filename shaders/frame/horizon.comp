// The sky and far trees before it, of several samples a pixel: radiance.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/horizon.glsl"
