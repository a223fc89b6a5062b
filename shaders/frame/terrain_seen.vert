// The terrain, seen by the camera: where it is, and no more. What it looks like is found once a pixel, where it is seen.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/terrain.glsl"

layout(location = 0) flat out uint quad;

void main() {
    vec2 within;
    vec3 place;
    vec3 position = terrain_vertex(quads.items[p.first_quad + gl_InstanceIndex], gl_VertexIndex, TERRAIN_CELLS, within, place);
    quad = uint(gl_InstanceIndex) + 1u;
    gl_Position = view.v.clip_from_world * vec4(position, 1.0);
}
