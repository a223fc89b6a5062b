// Heights and slopes of one terrain quad into its layer of the tile caches. Positions are whole steps of the terrain's
// finest grid, so that quads of any level agree to the bit where they meet. One workgroup column a quad.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/terrain.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Quads { TerrainQuad items[]; } quads;
layout(binding = 1) uniform sampler2DArray heights;
layout(binding = 2, r32f) writeonly uniform image2DArray height_tiles;
layout(binding = 3, rgba16f) writeonly uniform image2DArray slope_tiles;
layout(push_constant) uniform Push { TerrainParameters p; };

// Height and slope at a position of the finest grid; the terrain ends at its last sample.
vec3 ground(vec2 grid) {
    vec2 t = min(grid, p.last) * p.texels_per_step;
    vec2 cell = floor(t);
    vec3 h = height_and_slope(heights, ivec2(cell), t - cell);
    return vec3(h.x, h.yz * (p.texels_per_step / p.step));
}

void main() {
    TerrainQuad q = quads.items[p.first_quad + gl_WorkGroupID.y];
    uint k = gl_GlobalInvocationID.x;
    if (k < TERRAIN_SLOPES * TERRAIN_SLOPES) {
        uvec2 at = uvec2(k % TERRAIN_SLOPES, k / TERRAIN_SLOPES);
        vec3 g = ground(vec2(q.corner) + vec2(at) * (0.5 * float(q.spacing)));
        imageStore(slope_tiles, ivec3(at, q.layer), vec4(g.yz, 0.0, 0.0));
    }
    if (k < TERRAIN_HEIGHTS * TERRAIN_HEIGHTS) {
        uvec2 at = uvec2(k % TERRAIN_HEIGHTS, k / TERRAIN_HEIGHTS);
        vec3 g = ground(vec2(q.corner) + vec2(at) * float(q.spacing));
        imageStore(height_tiles, ivec3(at, q.layer), vec4(g.x, 0.0, 0.0, 0.0));
    }
}
