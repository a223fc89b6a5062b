// A coverage tile of one species: coverage and its density.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#define COVER_FORMAT rg16f
#include "forest/coverage_resolve.glsl"
