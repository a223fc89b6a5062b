// Radiance of the trees of a tile's pixels, and of the ground where samples see that.
#include "frame/trees/tiles/shade.glsl"

layout(binding = 12, rgba16f) uniform writeonly image2DArray radiance;

shared vec3 colours[8u * MOST_ITEMS];

void main() {
    uvec2 corner = gl_WorkGroupID.xy * TILE_SIDE;
    uint column = gl_LocalInvocationIndex;
    list_items(corner, column);
    barrier();
    uint total = 0u;
    for (uint c = 0u; c < 8u; c++) total += counts[c];
    for (uint i = column; i < total; i += 8u) {
        uint slot = item_slot(i);
        Shaded s = shade(ranks[slot], item_offset(corner, slot));
        colours[slot] = s.parts.sun + s.parts.sky;
    }
    barrier();
    uint item = column * MOST_ITEMS, end = item + counts[column];
    for (uint row = 0u; row < TILE_SIDE; row++) {
        vec3 sum = vec3(0.0);
        uint covered = 0u;
        while (item < end && places[item] >> 8u == row) {
            uint samples = places[item] & 0xffu;
            sum += float(bitCount(samples)) * colours[item];
            covered |= samples;
            item++;
        }
        ivec2 pixel = ivec2(corner + uvec2(column, row));
        for (uint k = 0u; k < SAMPLES; k++) {
            if (covered != 0u && (covered >> k & 1u) == 0u) sum += ground_colour(pixel, int(k));
        }
        if (covered != 0u) imageStore(radiance, ivec3(pixel, 0), vec4(sum * (1.0 / float(SAMPLES)), 1.0));
    }
}
