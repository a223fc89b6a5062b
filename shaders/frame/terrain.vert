// The terrain, seen by the camera.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/terrain.glsl"
#include "frame/forest_node.glsl"

layout(std430, binding = 7) readonly buffer Nodes { ForestNode items[]; } nodes;
layout(constant_id = 0) const uint COVER_CHANNELS = 0u;

layout(location = 0) out vec3 position;
layout(location = 1) out vec2 slope_at;
layout(location = 2) flat out uint layer;
layout(location = 3) out vec3 cover_at;
layout(location = 4) flat out vec2 cover_disc; // and tile coordinates a metre
layout(location = 5) flat out uint cover_layer;
// At the centre of the covered samples: a pixel's centre beyond the edge of a triangle seen from its side would be
// extrapolated far, to fractions beyond 0 and 1 and to negative light.
layout(location = 6) centroid out vec4 tree_sun;   // w: lit fraction of trees
layout(location = 7) centroid out vec4 tree_sky;   // w: nu
layout(location = 8) centroid out vec4 paths;      // over, seen, joint; w: coverage where ground is seen
layout(location = 9) centroid out vec4 vertical;   // sky, gap, middle, half_depth

ForestNode forest_node(ivec2 at) {
    uint quad = uint(gl_InstanceIndex) * FOREST_NODES * FOREST_NODES;
    return nodes.items[quad + uint(at.y) * FOREST_NODES + uint(at.x)];
}

void main() {
    TerrainQuad q = quads.items[p.first_quad + gl_InstanceIndex];
    vec2 within;
    vec3 place;
    position = terrain_vertex(q, gl_VertexIndex, TERRAIN_CELLS, within, place);
    slope_at = (within * float(TERRAIN_SLOPES - 1u) + 0.5) / float(TERRAIN_SLOPES);
    layer = q.layer;
    cover_at = vec3(q.cover_offset + q.cover_scale * place.xy, q.cover_floor * place.z);
    cover_disc = vec2(q.cover_disc, q.cover_scale / (p.step * float(q.spacing * int(TERRAIN_CELLS))));
    cover_layer = q.cover_layer;
    gl_Position = view.v.clip_from_world * vec4(position, 1.0);
    tree_sun = tree_sky = paths = vec4(0.0);
    vertical = vec4(0.0);
    if (COVER_CHANNELS > 0u) {
        // Every second vertex is a node; the others are between two, but for how far they have morphed to one.
        ivec2 at = ivec2(gl_VertexIndex % TERRAIN_HEIGHTS, gl_VertexIndex / TERRAIN_HEIGHTS);
        ivec2 low = at >> 1, high = (at + 1) >> 1;
        float between = 0.5 * (1.0 - place.z);
        ForestNode f = mix_nodes(mix_nodes(forest_node(low), forest_node(ivec2(high.x, low.y)), between),
                                 mix_nodes(forest_node(ivec2(low.x, high.y)), forest_node(high), between), between);
        tree_sun = vec4(f.tree_sun, f.tree_lit);
        tree_sky = vec4(f.tree_sky, f.converged);
        paths = vec4(f.over, f.seen, f.joint, f.seen_coverage);
        vertical = vec4(f.sky, f.gap, f.middle, f.half_depth);
    }
}
