// The terrain, seen by the sun: one cascade a draw, its layer chosen here.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_ARB_shader_viewport_layer_array : require
#include "interface.glsl"
#include "frame/terrain.glsl"

void main() {
    vec2 within;
    vec3 place;
    vec3 position = terrain_vertex(quads.items[p.first_quad + gl_InstanceIndex], gl_VertexIndex, within, place);
    vec4 at = view.v.cascade_from_world[cascade] * vec4(position, 1.0);
    // Ground before the cascade's near side casts from there.
    at.z = min(at.z, 1.0);
    gl_Position = at;
    gl_Layer = int(cascade);
}
