// Meshes in a cascade, whose layer is chosen here.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_ARB_shader_viewport_layer_array : require
#define LAYERED
#include "interface.glsl"
#include "frame/trees/meshes/shadow.glsl"
