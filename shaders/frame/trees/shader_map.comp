// The shader-map at every second vertex of each terrain quad that the camera sees; the vertex shader interpolates. Angles,
// slopes and densities vary little within a cell of the mesh, and what varies faster, the coverage, is left to the pixel.
// Where a quad morphs to its parent's grid, nodes that the parent does not have become means of their neighbours, so
// that light, like shape, is the same on both sides of a border and changes smoothly when quads split.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/light.glsl"
#include "frame/terrain.glsl"
#include "frame/forest_node.glsl"

layout(local_size_x = 64) in;
layout(binding = 3) uniform sampler2DArray slope_tiles;
layout(binding = 6) uniform sampler2DArray cover_tiles;
layout(std430, binding = 7) writeonly buffer Nodes { ForestNode items[]; } nodes;
layout(constant_id = 0) const uint COVER_CHANNELS = 0u;
#include "frame/trees/shader_map.glsl"

ForestNode node(TerrainQuad q, ivec2 at) {
    vec2 within;
    vec3 place;
    uint vertex = uint(2 * at.y) * TERRAIN_HEIGHTS + uint(2 * at.x);
    vec3 position = terrain_vertex(q, vertex, TERRAIN_CELLS, within, place);
    vec2 slope = texelFetch(slope_tiles, ivec3(at * int((TERRAIN_SLOPES - 1u) / (FOREST_NODES - 1u)), q.layer), 0).rg;
    vec3 n = normalize(vec3(-slope, 1.0));
    vec2 cover_at = q.cover_offset + q.cover_scale * place.xy;
    vec4 channels[COVER_GROUPS];
    for (uint g = 0u; g < COVER_GROUPS; g++) channels[g] = vec4(0.0);
    for (uint g = 0u; 4u * g < COVER_CHANNELS; g++) {
        channels[g] = textureLod(cover_tiles, vec3(cover_at, float(q.cover_layer + g)), 2.0);
    }
    float thickness[MAX_SPECIES];
    for (uint k = 0u; k < MAX_SPECIES; k++) thickness[k] = channels[(k + 1u) >> 2u][(k + 1u) & 3u];
    float distance = length(position);
    return shader_map(position * (-1.0 / max(distance, 1e-6)), n, distance, thickness);
}

shared ForestNode grid[FOREST_NODES * FOREST_NODES];


void main() {
    TerrainQuad q = quads.items[p.first_quad + gl_WorkGroupID.x];
    for (uint k = gl_LocalInvocationIndex; k < FOREST_NODES * FOREST_NODES; k += 64u) {
        grid[k] = node(q, ivec2(k % FOREST_NODES, k / FOREST_NODES));
    }
    barrier();
    for (uint k = gl_LocalInvocationIndex; k < FOREST_NODES * FOREST_NODES; k += 64u) {
        ivec2 at = ivec2(k % FOREST_NODES, k / FOREST_NODES), odd = at & 1, low = at - odd, high = at + odd;
        int side = int(FOREST_NODES);
        ForestNode south = mix_nodes(grid[low.y * side + low.x], grid[low.y * side + high.x], 0.5);
        ForestNode north = mix_nodes(grid[high.y * side + low.x], grid[high.y * side + high.x], 0.5);
        float morph = smoothstep(q.morph.x, q.morph.y, length(grid_position(q, 2 * at)));
        nodes.items[gl_WorkGroupID.x * FOREST_NODES * FOREST_NODES + k] = mix_nodes(grid[k], mix_nodes(south, north, 0.5), morph);
    }
}
