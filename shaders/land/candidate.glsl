// The trees of a seed quad: points of its Wang tiles, thinned to the local density, then its listed trees. Whoever
// includes this gets the same trees, to the bit: seeds are drawn one by one, coverage tiles show their discs.
// Needs the parameters `p`, and `pattern`, `listed`, `species`, `scene_size`, `heights` and `densities` to be declared
// before, and physics/hash.glsl, physics/terrain.glsl and land/density.glsl.

#include "land/wang.glsl"

// Height, and slope east and north, at a position in metres from the quad's corner.
vec3 ground(SeedQuad q, vec2 position) {
    if (p.has_heights == 0u) return vec3(0.0);
    vec3 h = height_and_slope(heights, q.texel, q.texel_offset + position / p.cell_size);
    return vec3(h.x, h.yz / p.cell_size);
}

// The tree of a slot of the quad's Wang tiles, or behind `pattern_count` of its list; false where there is none.
bool candidate(SeedQuad q, uint index, uint pattern_count, out Seed s) {
    s = Seed(vec2(0.0), 0.0, 0.0, 0u, 0u, 0u, 0u);
    vec2 corner = vec2(q.texel) * p.cell_size + q.texel_offset * p.cell_size;
    bool is_listed = index >= pattern_count;
    ListedTree tree = ListedTree(vec2(0.0), 0.0, -1.0, 0u, 0u);
    uint id, kind = 0u;
    if (is_listed) {
        tree = listed.items[q.first_position + index - pattern_count];
        s.position = tree.position;
        kind = tree.species;
        id = hash2(p.seed, hash2(0x9e3779b9u + tree.species, tree.index));
    } else {
        uint slot = index % p.points_per_tile, k = index / p.points_per_tile;
        ivec2 within = ivec2(k % p.tiles_per_side, k / p.tiles_per_side);
        ivec2 tile = q.tile + within;
        vec2 point = pattern.items[wang_tile(p.seed, tile) * p.points_per_tile + slot].position;
        if (point.x < 0.0) return false;
        s.position = (vec2(within) + point) * p.tile_side;
        id = hash2(p.seed, hash2(uint(tile.x), hash2(uint(tile.y), slot)));
    }
    vec2 world = corner + s.position;
    // A listed tree is inside, whatever rounding does to its place on the border.
    if (!is_listed && (any(lessThan(world, vec2(0.0))) || any(greaterThan(world, p.extent)))) return false;
    vec3 g = ground(q, s.position);
    float slope = length(g.yz), total = 0.0;
    float densities_here[MAX_SPECIES];
    for (uint k = 0u; k < scene_size.species_count; k++) {
        densities_here[k] = local_density(species.items[k], world, p.extent, g.x, slope);
        total += densities_here[k];
    }
    if (!is_listed) {
        if (!(unit(hash(id ^ HASH_THIN)) * p.pattern_density < total)) return false;
        float pick = unit(hash(id ^ HASH_SPECIES)) * total;
        for (uint k = 0u; k < scene_size.species_count; k++) {
            if (densities_here[k] > 0.0) kind = k;
            pick -= densities_here[k];
            if (pick < 0.0) break;
        }
    }
    vec2 range = species.items[kind].scale_range;
    // The same bits on every device: no product and sum may become one operation.
    float u = unit(hash(id ^ HASH_SCALE));
    precise float own = range.x * (1.0 - u) + range.y * u;
    s.scale = tree.scale > 0.0 ? tree.scale : own;
    uint turn = tree.turn >= 0.0 ? uint(tree.turn * 65536.0) & 0xffffu : hash(id ^ HASH_TURN) & 0xffffu;
    s.turn_tint = turn | (hash(id ^ HASH_TINT) & 0xffff0000u);
    s.ground = g.x;
    s.identity = id;
    s.slope = packHalf2x16(g.yz);
    // As dense as trees of this species would have to be to cover what all trees here do.
    float thickness = 0.0;
    for (uint k = 0u; k < scene_size.species_count; k++) {
        Species other = species.items[k];
        float here = other.listed_density > 0.0 ? horizontal_density(other, world, p.extent, g.x, slope) : densities_here[k];
        thickness += other.mean_area * here;
    }
    s.species_density = kind | packHalf2x16(vec2(0.0, sqrt(thickness / species.items[kind].mean_area)));
    return true;
}
