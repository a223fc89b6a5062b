// The terrain, seen by the camera.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/terrain.glsl"

layout(location = 0) out vec3 position;
layout(location = 1) out vec2 slope_at;
layout(location = 2) flat out uint layer;

void main() {
    TerrainQuad q = quads.items[p.first_quad + gl_InstanceIndex];
    vec2 within;
    position = terrain_vertex(q, gl_VertexIndex, within);
    slope_at = (within * float(TERRAIN_SLOPES - 1u) + 0.5) / float(TERRAIN_SLOPES);
    layer = q.layer;
    gl_Position = view.v.clip_from_world * vec4(position, 1.0);
}
