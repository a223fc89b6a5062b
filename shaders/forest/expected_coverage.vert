// A triangle over a whole coverage tile.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_ARB_shader_viewport_layer_array : require
#include "interface.glsl"

layout(push_constant) uniform Push { SeedParameters p; CoverageTile tile; };

void main() {
    gl_Position = vec4(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0, 0.0, 1.0);
    gl_Layer = int(tile.layer);
}
