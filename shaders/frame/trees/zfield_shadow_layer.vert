// A quad around a tree in a cascade, drawn to its layer alone.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/zfield_shadow.glsl"
