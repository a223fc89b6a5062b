// Which of the sixteen tiles of the point pattern lies at a place of the plane, counted in tiles east and north. Twin: tile_kind in
// src/land/candidate.rs. Needs physics/hash.glsl.

uint edge_colour(uint seed, ivec2 edge, uint axis) { return hash2(seed + axis, hash2(uint(edge.x), uint(edge.y))) & 1u; }

uint wang_tile(uint seed, ivec2 tile) {
    return edge_colour(seed, tile, 1u) | edge_colour(seed, tile + ivec2(0, 1), 1u) << 1u | edge_colour(seed, tile, 2u) << 2u |
           edge_colour(seed, tile + ivec2(1, 0), 2u) << 3u;
}
