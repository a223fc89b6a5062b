// Light on the ground where samples see it, once a pixel, and the sky behind. One workgroup a tile of 8 x 8 pixels: every invocation lists
// the pixels of its column that see ground; then all shade the list in turn.
#include "frame/ground_pixels.glsl"
#include "frame/ground.glsl"
#include "frame/view_mode.glsl"
#include "frame/ground_mode.glsl"
#include "frame/column_items.glsl"

layout(local_size_x = 8) in;
layout(binding = 8) uniform usamplerBuffer trees_seen; // counted from 1, a sample
layout(constant_id = 11) const bool NEAR_TREES = false; // meshes or cards are drawn before the ground
layout(constant_id = 3) const bool TREES = true;    // z-fields are drawn before the ground

shared uint items[8u * TILE_SIDE]; // pixels of each column to shade: its row | samples of the ground << 8 | of the sky << 16

// Lists the pixels of this invocation's column that see ground. Where others see the sky, that is all that they do.
void list_pixels(uvec2 corner, uint column, uvec2 size) {
    uint count = 0u;
    for (uint row = 0u; row < TILE_SIDE; row++) {
        uvec2 pixel = min(corner + uvec2(column, row), size - 1u);
        bool inside = pixel == corner + uvec2(column, row);
        int at = int((pixel.y * size.x + pixel.x) * SAMPLES);
        uint open = (1u << SAMPLES) - 1u, samples = ground_samples(ivec2(pixel));
        for (uint k = 0u; k < SAMPLES; k++) {
            bool hidden = NEAR_TREES && !is_ground(surface_seen(ivec2(pixel), int(k)));
            if (TREES) hidden = hidden || texelFetch(trees_seen, at + int(k)).x != 0u;
            open &= hidden ? ~(1u << k) : ~0u;
        }
        uint sky = open & ~samples;
        samples &= open;
        if (inside && samples != 0u) {
            items[column * TILE_SIDE + count] = row | samples << 8u | sky << 16u;
            count++;
        }
        if (inside && samples == 0u && open != 0u && (!SKY_DRAWN || open + 1u != 1u << SAMPLES)) {
            store_pixel(ivec2(pixel), scaled(sky_at(ivec2(pixel)), float(bitCount(open)) / float(SAMPLES)));
        }
        if (inside && (open & 1u) != 0u) store_first(ivec2(pixel), 0u, surface_depth(ivec2(pixel), 0));
    }
    counts[column] = count;
}

// The ground that a pixel's samples see; `seen` are they.
Shown ground_at(ivec2 pixel, uint seen, vec2 size) {
    vec3 n;
    GroundPoint at = point_at(pixel, seen, size, camera_of(view.v, size), n);
    GroundLight g = ground_light(at, n);
#ifdef LAYERS
    return Shown(vec4(g.sun, 1.0), vec4(g.sky, g.trees), g.fractions);
#else
    if (VIEW_MODE != 0u) return Shown(vec4(ground_mode(at, g, n), 1.0));
    return Shown(vec4(g.sun + g.sky, 1.0));
#endif
}

void main() {
    uvec2 size = picture_size(), corner = tile_corner();
    uint column = gl_LocalInvocationIndex;
    list_pixels(corner, column, size);
    barrier();
    uint total = item_count();
    for (uint i = column; i < total; i += 8u) {
        uint slot = item_slot(i, TILE_SIDE), found = items[slot];
        ivec2 pixel = ivec2(corner + uvec2(slot / TILE_SIDE, found & 0xffu));
        uint seen = found >> 8u & 0xffu, sky = found >> 16u;
        float part = 1.0 / float(SAMPLES);
        Shown ground = scaled(ground_at(pixel, seen, vec2(size)), part * float(bitCount(seen)));
        Shown behind = shown_nothing();
        if (sky != 0u) behind = scaled(sky_at(pixel), part * float(bitCount(sky))); // where no sample sees it there may be none
        store_pixel(pixel, sum(ground, behind));
    }
}
