// Vertices of slices of a forest: those of the ground, raised. An instance is a quad of the ground << 6 | a slice of the stack that the quad's nearest
// point has.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/handover.glsl"
#include "land/wang.glsl"
#include "forest/wind.glsl"
#include "frame/terrain.glsl"
#include "frame/trees/shells/shell.glsl"

layout(location = 0) out vec3 position;      // from the camera
layout(location = 1) out vec3 cover_at;      // in the quad's coverage tile; least level
layout(location = 2) out vec2 detail_height; // log2 of the number of slices here; height of this one, m
layout(location = 3) flat out uvec3 what;    // quad; slice; first layer of the coverage tile

// By so much detail changes less within a cell of the mesh.
const float ROOM = 0.25;

void main() {
    uint quad = uint(gl_InstanceIndex) >> 6u, code = uint(gl_InstanceIndex) & 63u;
    TerrainQuad q = quads.items[quad];
    vec2 within;
    vec3 place;
    vec3 ground = terrain_vertex(q, gl_VertexIndex, SHELL_CELLS, within, place);
    float far = length(ground), detail = min(shell_detail(far), shell_steps(shell_slices(code)));
    float height = table.t.height * shell_height(code, detail);
    position = ground + vec3(0.0, 0.0, height);
    cover_at = vec3(q.cover_offset + q.cover_scale * place.xy, q.cover_floor * place.z);
    detail_height = vec2(detail, height);
    what = uvec3(quad, code, q.cover_layer);
    gl_Position = view.v.clip_from_world * vec4(position, 1.0);
    // What shows nothing all around is before the near plane: slices that others show there, and what is so near that trees stand one by one.
    bool shown = shell_shows(code, shell_stack(detail + ROOM, code));
    if (!shown || far < SHELL_ROOM * table.t.begin) gl_Position.z = 2.0 * gl_Position.w;
}
