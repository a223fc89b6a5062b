// The ground is an opaque caster.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "physics/shadow.glsl"

layout(location = 0) in float depth;
layout(location = 0) out uint caster;

void main() { caster = pack_caster(depth, 1.0); }
