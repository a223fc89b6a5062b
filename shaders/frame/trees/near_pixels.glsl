// Surfaces of trees that the graphics pipeline has found, lit once a pixel and surface. One workgroup a tile of 8 x 8 pixels, as for
// z-fields: every invocation lists what its column of pixels sees; all light the list in turn; each puts its pixels together.
//
// Whoever includes this says which surfaces are its own, which others' light is in the picture before (is_mine, is_stored), of which species one
// is, counted from 1 (species_seen; 0: it is not known) and what it shows (shade). Needs `view`, `p.size`, frame/shown.glsl, frame/camera.glsl and frame/surfaces_seen.glsl.

layout(local_size_x = 8) in;
layout(binding = 7) uniform usamplerBuffer seen; // z-field trees, which are before such surfaces
layout(constant_id = 0) const uint SAMPLES = 4u;
layout(constant_id = 5) const bool Z_FIELDS = true; // there are some

// Whether a sample sees a z-field.
bool sees_zfield(ivec2 pixel, uint k) {
    bool sees = false;
    if (Z_FIELDS) sees = texelFetch(seen, int((pixel.y * int(p.size.x) + pixel.x) * int(SAMPLES)) + int(k)).x != 0u;
    return sees;
}

uint sample_sees(ivec2 pixel, int k) {
    uint what = surface_seen(pixel, k);
    return is_mine(what) && !sees_zfield(pixel, uint(k)) ? what : 0u;
}

// Whether a sample of a pixel sees what is in the picture already.
bool sees_past(ivec2 pixel) {
    bool past = false;
    for (uint k = 0u; k < SAMPLES; k++) past = past || (is_stored(surface_seen(pixel, int(k))) && !sees_zfield(pixel, k));
    return past;
}

#include "frame/trees/distinct.glsl"

// The mean place of samples of a pixel.
vec3 place_of(ivec2 pixel, uint samples) {
    Camera camera = camera_of(view.v, vec2(p.size));
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < SAMPLES; k++) {
        vec2 offset = vec2(pixel) + 0.5 + sample_offset(k, SAMPLES) - 0.5 * vec2(p.size);
        float deep = view.v.clip_from_world[3].z / max(surface_depth(pixel, int(k)), 1e-30);
        sum += (samples >> k & 1u) != 0u ? deep * ray_through(camera, offset) : vec3(0.0);
    }
    return sum / float(bitCount(samples));
}

void main() {
    uvec2 corner = tile_corner();
    uint column = gl_LocalInvocationIndex;
    list_items(corner, column);
    barrier();
    uint total = item_count();
    for (uint i = column; i < total; i += 8u) {
        uint slot = item_slot(i, MOST_ITEMS);
        shown[slot] = shade(ranks[slot], place_of(item_pixel(corner, slot), places[slot] & 0xffu));
    }
    barrier();
    uint item = column * MOST_ITEMS, end = item + counts[column];
    for (uint row = 0u; row < TILE_SIDE; row++) {
        uint covered, first;
        Shown all = row_shown(row, end, item, covered, first);
        ivec2 pixel = ivec2(corner + uvec2(column, row));
        if (covered != 0u && sees_past(pixel)) all = sum(all, load_pixel(pixel));
        if (covered != 0u) store_pixel(pixel, all);
#ifdef LAYERS
        if (first != ~0u) {
            store_first(pixel, species_seen(ranks[first]), surface_depth(pixel, 0));
        }
#endif
    }
}
