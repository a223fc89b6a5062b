// A coverage tile from its sums: the discs' union, then each species' density times mean area, and three mip levels.
// Leaves zeros in the scratch buffer for the next tiles. One workgroup 16 x 16 texels.
#include "physics/terrain.glsl"

const uint BLOCK = 16u;
layout(local_size_x = 256) in;
layout(std140, binding = 0) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(std430, binding = 1) readonly buffer Tiles { CoverageTile items[]; } tiles;
layout(std430, binding = 2) buffer Sums { uint items[]; } sums;
layout(binding = 3) uniform sampler2DArray heights;
layout(binding = 4) uniform sampler2DArray densities;
layout(binding = 5, COVER_FORMAT) writeonly uniform image2DArray level_0;
layout(binding = 6, COVER_FORMAT) writeonly uniform image2DArray level_1;
layout(binding = 7, COVER_FORMAT) writeonly uniform image2DArray level_2;
layout(binding = 8, COVER_FORMAT) writeonly uniform image2DArray level_3;
layout(push_constant) uniform Push { SeedParameters p; CoverageParameters c; };
layout(constant_id = 0) const uint COVER_SIDE = 256u;
layout(constant_id = 1) const uint SPECIES_COUNT = 1u;

#include "land/density.glsl"
#include "forest/coverage.glsl"
#include "forest/expected.glsl"

// Thicknesses at the corners of a grid over the block, species after species; then texels of a mip level.
shared float evaluated[(BLOCK + 1u) * (BLOCK + 1u) * MAX_SPECIES];
shared vec4 reduced[BLOCK * BLOCK];

// Adds each species' thickness at a place to those at `first`; metres from the tile's corner.
void add_thickness(CoverageTile tile, vec2 within, uint first, uint stride, float weight) {
    vec2 world = vec2(tile.cell) * p.cell_size + tile.cell_offset * p.cell_size + within;
    vec3 g = vec3(0.0);
    if (p.has_heights != 0u) g = height_and_slope(heights, tile.cell, tile.cell_offset + within / p.cell_size);
    float slope = length(g.yz) / p.cell_size;
    for (uint k = 0u; k < SPECIES_COUNT; k++) {
        Species s = species.items[k];
        float density = horizontal_density(s, world, p.extent, g.x, slope);
        evaluated[first + k * stride] += weight * s.mean_area * density;
    }
}

// Densities are smooth: where texels are much finer than their maps, every `step`-th texel is evaluated; where texels
// are much coarser, several places in each.
void evaluate(CoverageTile tile, uvec2 block, uint thread) {
    uint along = BLOCK / tile.step + 1u, stride = along * along;
    float apart = tile.texel / float(tile.samples), weight = 1.0 / float(tile.samples * tile.samples);
    for (uint k = thread; k < stride; k += BLOCK * BLOCK) {
        for (uint s = 0u; s < SPECIES_COUNT; s++) evaluated[k + s * stride] = 0.0;
        vec2 texel = vec2(block + tile.step * uvec2(k % along, k / along));
        for (uint j = 0u; j < tile.samples; j++) {
            for (uint i = 0u; i < tile.samples; i++) {
                add_thickness(tile, texel * tile.texel + (vec2(i, j) + 0.5) * apart, k, stride, weight);
            }
        }
    }
}

float coverage_of(CoverageTile tile, uvec2 texel) {
    float sum = 0.0;
    uint side = COVER_SIDE * tile.fine;
    for (uint j = 0u; j < tile.fine; j++) {
        for (uint i = 0u; i < tile.fine; i++) {
            uint at = tile.first + (texel.y * tile.fine + j) * side + texel.x * tile.fine + i;
            sum += covered(sums.items[at]);
            sums.items[at] = 0u;
        }
    }
    return sum / float(tile.fine * tile.fine);
}

// The mean of four texels of the level before, for the first `side` x `side` threads of the block.
vec4 reduce(uint thread, uint side) {
    uint at = (thread / side) * 4u * side + (thread % side) * 2u;
    vec4 mean = thread < side * side ? 0.25 * (reduced[at] + reduced[at + 1u] + reduced[at + 2u * side] +
                                               reduced[at + 2u * side + 1u]) : vec4(0.0);
    barrier();
    if (thread < side * side) reduced[thread] = mean;
    barrier();
    return mean;
}

void main() {
    CoverageTile tile = tiles.items[c.first_tile + gl_WorkGroupID.z];
    uint thread = gl_LocalInvocationIndex;
    uvec2 block = BLOCK * gl_WorkGroupID.xy, local = uvec2(thread % BLOCK, thread / BLOCK), texel = block + local;
    evaluate(tile, block, thread);
    barrier();
    uint along = BLOCK / tile.step + 1u, stride = along * along;
    uint corner = (local.y / tile.step) * along + local.x / tile.step;
    vec2 f = vec2(local % tile.step) / float(tile.step);
    // Beyond the terrain grows nothing.
    vec2 low = vec2(tile.cell) * p.cell_size + tile.cell_offset * p.cell_size + vec2(texel) * tile.texel;
    vec2 part = clamp(min(low + tile.texel, p.extent) - max(low, 0.0), 0.0, tile.texel) / tile.texel;
    vec4 channels[COVER_GROUPS];
    for (uint g = 0u; g < COVER_GROUPS; g++) channels[g] = vec4(0.0);
    for (uint k = 0u; k < SPECIES_COUNT; k++) {
        uint at = corner + k * stride;
        float south = mix(evaluated[at], evaluated[at + 1u], f.x);
        float north = mix(evaluated[at + along], evaluated[at + along + 1u], f.x);
        channels[(k + 1u) / 4u][(k + 1u) % 4u] = part.x * part.y * mix(south, north, f.y);
    }
    channels[0].x = tile.fine == 0u ? expected_coverage(channels) : coverage_of(tile, texel);
    for (uint g = 0u; 4u * g < SPECIES_COUNT + 1u; g++) {
        ivec3 at = ivec3(texel, tile.layer + g);
        imageStore(level_0, at, channels[g]);
        reduced[thread] = channels[g];
        barrier();
        for (uint level = 1u; level < COVER_LEVELS; level++) {
            uint side = BLOCK >> level;
            vec4 mean = reduce(thread, side);
            ivec3 to = ivec3(ivec2(block >> level) + ivec2(thread % side, thread / side), tile.layer + g);
            bool inside = thread < side * side;
            if (inside && level == 1u) imageStore(level_1, to, mean);
            if (inside && level == 2u) imageStore(level_2, to, mean);
            if (inside && level == 3u) imageStore(level_3, to, mean);
        }
        barrier();
    }
}
