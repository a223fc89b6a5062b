// What trees cover of the ground in top view, and how densely each species stands (BN12, section 4): a lookup in the
// coverage tile of the terrain quad. Where discs are too small to tell, coverage is what the tables expect.

layout(binding = 6) uniform sampler2DArray cover_tiles;
layout(constant_id = 0) const uint COVER_CHANNELS = 0u; // of a tile: 2 or four a layer; 0: no trees
layout(constant_id = 1) const uint COVER_SIDE = 256u;        // texels along a side of a tile

// A place in a coverage tile.
struct CoverPoint {
    vec3 at;          // texture coordinates in the tile, and least mip level
    float scale;      // of them a metre
    float disc;       // log2 of the mean disc area in texels of mip 0
    uint layer;       // first layer
    float footprint;  // log2 of the texture coordinates that a pixel spans along its longer side
};

struct Cover {
    float texel;                      // of the level of detail, in texels of mip 0
    float resolved;                   // 0 where discs are too small to tell
    vec4 channels[COVER_GROUPS];      // coverage as stored, then density times mean area of each species
};

// Level of detail of a pixel.
float cover_lod(CoverPoint place) { return max(place.footprint + log2(float(COVER_SIDE)) + view.v.footprint, place.at.z); }

// Width of a texel of it, in texels of mip 0.
float cover_texel(CoverPoint place) { return exp2(min(cover_lod(place), 3.0)); }

// The same place at texels no finer than a span in the tile's coordinates: their mean over it.
CoverPoint coarsened(CoverPoint place, float span) {
    place.footprint = max(place.footprint, log2(max(span, 1e-9)) - view.v.footprint);
    return place;
}

// The tile's level of detail follows the pixel's footprint. Where a quad morphs to its parent's shape the least level
// rises to 1, where the parent's tile takes over at its level 0 with the same texels: nothing changes when quads do.
Cover cover(CoverPoint place) {
    Cover c;
    for (uint g = 0u; g < COVER_GROUPS; g++) c.channels[g] = vec4(0.0);
    float lod = cover_lod(place);
    for (uint g = 0u; 4u * g < COVER_CHANNELS; g++) {
        c.channels[g] = textureLod(cover_tiles, vec3(place.at.xy, float(place.layer + g)), min(lod, 3.0));
    }
    // Missing channels read 0, and a missing fourth 1.
    if (COVER_CHANNELS == 2u) c.channels[0].w = 0.0;
    c.texel = exp2(lod);
    // Discs fade where their mean is 1/4 to 1/16 of a texel of this level, and where levels end.
    c.resolved = clamp(0.5 * (place.disc + 4.0) - lod, 0.0, 1.0) * clamp(3.5 - lod, 0.0, 1.0);
    return c;
}

// What a pixel spans, from how far its right and lower neighbours' texture coordinates are.
float cover_footprint(vec2 dx, vec2 dy) { return 0.5 * log2(max(max(dot(dx, dx), dot(dy, dy)), 1e-30)); }
