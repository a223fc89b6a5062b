// Discs of the trees of a seed quad that reach into a coverage tile, without storing a seed: each texel of the scratch
// buffer sums -ln(1 - c) over the discs that cover the part c of it, in fixed point, so that the order of the sum does
// not matter. Discs at random leave the product of 1 - c of a texel open. One workgroup a seed quad and tile.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/terrain.glsl"

layout(local_size_x = 256) in;
layout(std430, binding = 0) readonly buffer Quads { SeedQuad items[]; } quads;
layout(std430, binding = 1) readonly buffer Pattern { PatternPoint items[]; } pattern;
layout(std430, binding = 2) readonly buffer Listed { ListedTree items[]; } listed;
layout(std140, binding = 3) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 4) readonly buffer Splats { CoverageSplat items[]; } splats;
layout(std430, binding = 5) readonly buffer Tiles { CoverageTile items[]; } tiles;
layout(std430, binding = 6) buffer Sums { uint items[]; } sums;
layout(binding = 7) uniform sampler2DArray heights;
layout(binding = 8) uniform sampler2DArray densities;
layout(std430, binding = 9) readonly buffer SceneSize { uint species_count; } scene_size;
layout(push_constant) uniform Push { SeedParameters p; CoverageParameters c; };
layout(constant_id = 0) const uint COVER_SIDE = 256u;

#include "land/density.glsl"
#include "land/candidate.glsl"
#include "forest/coverage.glsl"

shared uint drawn;
shared vec3 discs[256]; // centre and radius, in texels of the scratch buffer

void draw_disc(vec3 disc, int side, uint first) {
    float reach = disc_reach(disc.z);
    ivec2 low = max(ivec2(ceil(disc.xy - reach - 0.5)), 0);
    ivec2 high = min(ivec2(floor(disc.xy + reach - 0.5)), side - 1);
    for (int y = low.y; y <= high.y; y++) {
        for (int x = low.x; x <= high.x; x++) {
            uint sum = open_sum(disc_share(vec2(x, y) + 0.5 - disc.xy, disc.z));
            if (sum > 0u) atomicAdd(sums.items[first + uint(y * side + x)], sum);
        }
    }
}

void main() {
    CoverageSplat splat = splats.items[c.first_splat + gl_WorkGroupID.x];
    SeedQuad q = quads.items[c.first_splat + gl_WorkGroupID.x];
    CoverageTile tile = tiles.items[splat.tile];
    uint thread = gl_LocalInvocationIndex;
    int side = int(COVER_SIDE * tile.fine);
    float texels_per_metre = float(tile.fine) / tile.texel;
    // Only Wang tiles with points from which a disc reaches the tile.
    float last = float(p.tiles_per_side) - 1.0, across = float(COVER_SIDE) * tile.texel;
    vec2 low = clamp(floor((-splat.corner - c.largest_radius) / p.tile_side), 0.0, last + 1.0);
    vec2 high = clamp(floor((across - splat.corner + c.largest_radius) / p.tile_side), -1.0, last);
    uvec2 from = uvec2(low), size = uvec2(max(high - low + 1.0, 0.0));
    uint points = size.x * size.y * p.points_per_tile, total = points + q.position_count;
    uint pattern_count = p.tiles_per_side * p.tiles_per_side * p.points_per_tile;
    for (uint first = 0u; first < total; first += 256u) {
        if (thread == 0u) drawn = 0u;
        barrier();
        uint k = first + thread, wang = k / p.points_per_tile;
        uvec2 at = from + uvec2(wang % max(size.x, 1u), wang / max(size.x, 1u));
        uint slot = (at.y * p.tiles_per_side + at.x) * p.points_per_tile + k % p.points_per_tile;
        Seed s;
        if (k < total && candidate(q, k < points ? slot : pattern_count + k - points, pattern_count, s)) {
            float radius = species.items[s.species_density & 0xffffu].crown_radius * s.scale * texels_per_metre;
            vec2 centre = (splat.corner + s.position) * texels_per_metre;
            float reach = disc_reach(radius) + 0.5;
            bool seen = all(greaterThan(centre, vec2(-reach))) && all(lessThan(centre, float(side) + vec2(reach)));
            // In any order: sums do not tell.
            if (seen) discs[atomicAdd(drawn, 1u)] = vec3(centre, radius);
        }
        barrier();
        if (thread < drawn) draw_disc(discs[thread], side, tile.first);
        barrier();
    }
}
