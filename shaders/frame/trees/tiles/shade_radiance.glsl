// Radiance of the trees of a tile's pixels, on top of what the others of their samples see, which is there.
#include "frame/trees/tiles/shade.glsl"

layout(binding = 12, rgba16f) uniform image2DArray radiance;

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
        if (covered != 0u) {
            // A pixel whose every sample sees a tree holds nothing yet.
            vec3 before = covered + 1u == 1u << SAMPLES ? vec3(0.0) : imageLoad(radiance, ivec3(pixel, 0)).rgb;
            imageStore(radiance, ivec3(pixel, 0), vec4(before + sum * (1.0 / float(SAMPLES)), 1.0));
        }
    }
}
