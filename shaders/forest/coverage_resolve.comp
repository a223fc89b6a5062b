// A coverage tile of layers of four channels.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#define COVER_FORMAT rgba16f
#include "forest/coverage_resolve.glsl"
