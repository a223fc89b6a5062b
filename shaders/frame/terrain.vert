// The terrain, seen by the camera.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/terrain.glsl"

layout(location = 0) out vec3 position;
layout(location = 1) out vec2 slope_at;
layout(location = 2) flat out uint layer;
layout(location = 3) out vec3 cover_at;
layout(location = 4) flat out float cover_disc;
layout(location = 5) flat out uint cover_layer;

void main() {
    TerrainQuad q = quads.items[p.first_quad + gl_InstanceIndex];
    vec2 within;
    vec3 place;
    position = terrain_vertex(q, gl_VertexIndex, within, place);
    slope_at = (within * float(TERRAIN_SLOPES - 1u) + 0.5) / float(TERRAIN_SLOPES);
    layer = q.layer;
    cover_at = vec3(q.cover_offset + q.cover_scale * place.xy, q.cover_floor * place.z);
    cover_disc = q.cover_disc;
    cover_layer = q.cover_layer;
    gl_Position = view.v.clip_from_world * vec4(position, 1.0);
}
