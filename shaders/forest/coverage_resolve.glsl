// A coverage tile from its sums: the discs' union, then each species' density times mean area, and three mip levels.
// Leaves zeros in the scratch buffer for the next tiles. One workgroup a region of 4 x 2 blocks, one invocation a block of
// 8 x 8 texels, which is one texel of the last level: nothing is handed from one to another but the densities that they
// interpolate, so there is one barrier, and none between levels.
#include "physics/terrain.glsl"

const uint SIDE = 8u; // of a block, texels
const uvec2 REGION = uvec2(4u, 2u) * SIDE;
layout(local_size_x = 8) in;
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

const uint GROUPS = (SPECIES_COUNT + 4u) / 4u; // layers of the tile

// Thicknesses at the corners of a grid over the region, species after species, two texels apart at least.
const uvec2 MOST_CORNERS = REGION / 2u + 1u;
shared float evaluated[MOST_CORNERS.x * MOST_CORNERS.y * MAX_SPECIES];

// Each species' thickness at a texel, in the channels of a tile. Densities are smooth: where texels are coarser than what
// they change in, the mean of several places.
void thickness_at(CoverageTile tile, vec2 texel, out vec4 channels[COVER_GROUPS]) {
    float apart = tile.texel / float(tile.samples), weight = 1.0 / float(tile.samples * tile.samples);
    for (uint g = 0u; g < COVER_GROUPS; g++) channels[g] = vec4(0.0);
    for (uint j = 0u; j < tile.samples; j++) {
        for (uint i = 0u; i < tile.samples; i++) {
            vec2 within = texel * tile.texel + (vec2(i, j) + 0.5) * apart; // metres from the tile's corner
            vec2 world = vec2(tile.cell) * p.cell_size + tile.cell_offset * p.cell_size + within;
            vec3 g = vec3(0.0);
            if (p.has_heights != 0u) g = height_and_slope(heights, tile.cell, tile.cell_offset + within / p.cell_size);
            float slope = length(g.yz) / p.cell_size;
            for (uint k = 0u; k < SPECIES_COUNT; k++) {
                Species s = species.items[k];
                float density = horizontal_density(s, world, p.extent, g.x, slope);
                channels[(k + 1u) / 4u][(k + 1u) % 4u] += weight * s.mean_area * density;
            }
        }
    }
}

// Where texels are much finer than what densities change in, every `step`-th is evaluated.
void evaluate(CoverageTile tile, uvec2 region, uint lane) {
    uvec2 corners = REGION / tile.step + 1u;
    uint count = tile.step > 1u ? corners.x * corners.y : 0u;
    for (uint k = lane; k < count; k += gl_WorkGroupSize.x) {
        vec4 channels[COVER_GROUPS];
        thickness_at(tile, vec2(region + tile.step * uvec2(k % corners.x, k / corners.x)), channels);
        for (uint s = 0u; s < SPECIES_COUNT; s++) evaluated[k + s * count] = channels[(s + 1u) / 4u][(s + 1u) % 4u];
    }
    barrier();
}

// The thicknesses at a texel of the region, between those evaluated.
void interpolate(CoverageTile tile, uvec2 local, out vec4 channels[COVER_GROUPS]) {
    uvec2 corners = REGION / tile.step + 1u, low = local / tile.step;
    vec2 f = vec2(local % tile.step) / float(tile.step);
    for (uint g = 0u; g < COVER_GROUPS; g++) channels[g] = vec4(0.0);
    for (uint k = 0u; k < SPECIES_COUNT; k++) {
        uint at = k * corners.x * corners.y + low.y * corners.x + low.x;
        float south = mix(evaluated[at], evaluated[at + 1u], f.x);
        float north = mix(evaluated[at + corners.x], evaluated[at + corners.x + 1u], f.x);
        channels[(k + 1u) / 4u][(k + 1u) % 4u] = mix(south, north, f.y);
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

// All channels of a texel of the region.
void texel_of(CoverageTile tile, uvec2 region, uvec2 local, out vec4 channels[COVER_GROUPS]) {
    uvec2 texel = region + local;
    if (tile.step > 1u) interpolate(tile, local, channels);
    else thickness_at(tile, vec2(texel), channels);
    // Beyond the terrain grows nothing.
    vec2 low = vec2(tile.cell) * p.cell_size + tile.cell_offset * p.cell_size + vec2(texel) * tile.texel;
    vec2 part = clamp(min(low + tile.texel, p.extent) - max(low, 0.0), 0.0, tile.texel) / tile.texel;
    for (uint g = 0u; g < GROUPS; g++) channels[g] *= part.x * part.y;
    channels[0].x = tile.fine == 0u ? expected_coverage(channels) : coverage_of(tile, texel);
}

// Adds a quarter of what a texel of the level before holds, and clears that for the next.
void add_quarter(inout vec4 sums[COVER_GROUPS], inout vec4 before[COVER_GROUPS]) {
    for (uint g = 0u; g < GROUPS; g++) {
        sums[g] += 0.25 * before[g];
        before[g] = vec4(0.0);
    }
}

void main() {
    CoverageTile tile = tiles.items[c.first_tile + gl_WorkGroupID.z];
    uint lane = gl_LocalInvocationIndex;
    uvec2 region = REGION * gl_WorkGroupID.xy, block = SIDE * uvec2(lane & 3u, lane >> 2u);
    evaluate(tile, region, lane);
    vec4 first[COVER_GROUPS], second[COVER_GROUPS], third[COVER_GROUPS];
    for (uint g = 0u; g < COVER_GROUPS; g++) first[g] = second[g] = third[g] = vec4(0.0);
    // In Morton order, every four texels are one of the next level.
    for (uint k = 0u; k < SIDE * SIDE; k++) {
        uvec2 local = block + uvec2(k & 1u | k >> 1u & 2u | k >> 2u & 4u, k >> 1u & 1u | k >> 2u & 2u | k >> 3u & 4u);
        ivec2 at = ivec2(region + local);
        vec4 channels[COVER_GROUPS];
        texel_of(tile, region, local, channels);
        for (uint g = 0u; g < GROUPS; g++) imageStore(level_0, ivec3(at, tile.layer + g), channels[g]);
        add_quarter(first, channels);
        if ((k & 3u) == 3u) {
            for (uint g = 0u; g < GROUPS; g++) imageStore(level_1, ivec3(at >> 1, tile.layer + g), first[g]);
            add_quarter(second, first);
        }
        if ((k & 15u) == 15u) {
            for (uint g = 0u; g < GROUPS; g++) imageStore(level_2, ivec3(at >> 2, tile.layer + g), second[g]);
            add_quarter(third, second);
        }
    }
    ivec2 at = ivec2(region + block) >> 3;
    for (uint g = 0u; g < GROUPS; g++) imageStore(level_3, ivec3(at, tile.layer + g), third[g]);
}
