// Meshes in a cascade, drawn to its layer alone.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/trees/meshes/shadow.glsl"
