// Vertices of the terrain: a grid that morphs to the next coarser one with distance, so that levels meet without cracks
// and change without popping. Positions are differences of whole finest-grid steps, equal to the bit in both quads.

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(std430, binding = 1) readonly buffer Quads { TerrainQuad items[]; } quads;
layout(binding = 2) uniform sampler2DArray height_tiles;
layout(push_constant) uniform Push { TerrainParameters p; };

// Place on the finest grid of a vertex of a quad; the terrain ends at its last sample.
vec2 grid_place(TerrainQuad q, ivec2 at) { return min(vec2(q.corner + at * q.spacing), p.last); }

vec3 grid_position(TerrainQuad q, ivec2 at) {
    float height = texelFetch(height_tiles, ivec3(at, q.layer), 0).r;
    vec2 grid = grid_place(q, at);
    // Relative to the camera's cell first: exact, whatever the distance from the corner of the terrain.
    return vec3((grid - vec2(view.v.grid_camera)) * p.step - view.v.grid_offset, height - view.v.camera_height);
}

// Position from the camera; position in the quad's tiles in [0, 1]; and (xy) position in its square of ground, in [0, 1],
// from which the former differs beyond the end of the terrain, with (z) how far it has morphed to the coarser grid.
// The vertex is of a mesh of `cells` a side, a power of two.
vec3 terrain_vertex(TerrainQuad q, uint vertex, uint cells, out vec2 within, out vec3 place) {
    int stride = int(TERRAIN_CELLS / cells);
    ivec2 at = stride * ivec2(vertex % (cells + 1u), vertex / (cells + 1u)), even = at - (at & stride);
    vec3 fine = grid_position(q, at);
    float morph = smoothstep(q.morph.x, q.morph.y, length(fine));
    vec3 coarse = grid_position(q, even);
    within = mix(vec2(at), vec2(even), morph) / float(TERRAIN_CELLS);
    vec2 grid = mix(grid_place(q, at), grid_place(q, even), morph) - vec2(q.corner);
    place = vec3(grid / float(q.spacing * int(TERRAIN_CELLS)), morph);
    return fine * (1.0 - morph) + coarse * morph;
}
