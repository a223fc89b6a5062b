// The sky, before which trees that are not drawn one by one stand where the ground ends, as if all samples that see no ground saw it. One
// workgroup a tile of 8 x 8 pixels: every invocation lists the pixels of its column just above that end; then all shade the list in turn.
#include "frame/ground_pixels.glsl"
#include "frame/column_items.glsl"

layout(local_size_x = 8) in;

const uint HORIZON_ROWS = 6u; // how far trees stand out from where the ground ends, pixels

// How many rows below a pixel of the sky the ground ends, or more than HORIZON_ROWS.
uint rows_to_ground(ivec2 pixel, ivec2 size) {
    // Under most of the sky there is more of it.
    ivec2 last = ivec2(pixel.x, min(pixel.y + int(HORIZON_ROWS), size.y - 1));
    uint row = ground_quad(last, 0) != 0u ? 0u : HORIZON_ROWS + 1u;
    while (row <= HORIZON_ROWS && (pixel.y + int(row) >= size.y || ground_samples(pixel + ivec2(0, row)) == 0u)) row++;
    return row;
}

shared uint items[8u * TILE_SIDE]; // pixels of each column to shade: its row | samples of the sky << 8 | rows to the ground << 16

// Lists the pixels of this invocation's column that see sky just above the ground. Where others see the sky, that is all that they do.
void list_pixels(uvec2 corner, uint column, uvec2 size) {
    uint count = 0u;
    for (uint row = 0u; row < TILE_SIDE; row++) {
        uvec2 pixel = min(corner + uvec2(column, row), size - 1u);
        bool inside = pixel == corner + uvec2(column, row);
        uint sky = (1u << SAMPLES) - 1u & ~ground_samples(ivec2(pixel));
        uint rows = sky != 0u ? rows_to_ground(ivec2(pixel), ivec2(size)) : HORIZON_ROWS + 1u;
        if (inside && rows <= HORIZON_ROWS) {
            items[column * TILE_SIDE + count] = row | sky << 8u | rows << 16u;
            count++;
        } else if (inside && sky != 0u && !SKY_DRAWN) {
            store_pixel(ivec2(pixel), sky_at(ivec2(pixel)));
        }
    }
    counts[column] = count;
}

// The highest of a pixel's samples of the ground.
uint highest(uint samples) {
    uint found = samples & -samples;
    for (uint k = 0u; k < SAMPLES; k++) {
        bool higher = sample_offset(k, SAMPLES).y < sample_offset(findLSB(found), SAMPLES).y;
        if ((samples >> k & 1u) != 0u && higher) found = 1u << k;
    }
    return found;
}

// Share of what a sight line along `ray` sees that are trees, above the ground's end at a point of normal n.
float standing_out(GroundPoint at, vec3 n, vec3 ray, float distance) {
    float above = max(dot(ray * distance - at.position, n) / n.z, 0.0);
    float low = max(at.vertical.z - at.vertical.w - above, 0.0), high = at.vertical.z + at.vertical.w - above;
    if (high <= low) return 0.0;
    float thickness = total_thickness(cover_under(at, -normalize(ray), n, low, high, true).channels);
    return 1.0 - exp(-thickness * at.paths.x * (high - low) / (2.0 * at.vertical.w));
}

// Those trees, and the sky that samples `sky` of a pixel see behind them, so many rows above the ground.
Shown standing_before_sky(ivec2 pixel, uint sky, uint rows, ivec2 size) {
    Camera camera = camera_of(view.v, vec2(size));
    ivec2 below = pixel + ivec2(0, rows);
    vec3 n;
    GroundPoint at = point_at(below, highest(ground_samples(below)), vec2(size), camera, n);
    float distance = dot(at.position, camera.forward), trees = 0.0;
    for (uint k = 0u; k < SAMPLES; k++) {
        if ((sky >> k & 1u) == 0u) continue;
        vec2 offset = vec2(pixel) + 0.5 + sample_offset(k, SAMPLES) - 0.5 * vec2(size);
        trees += standing_out(at, n, ray_through(camera, offset), distance);
    }
    trees /= float(bitCount(sky));
    vec3 sun = trees * max(at.tree_sun.rgb, 0.0), from_sky = trees * max(at.tree_sky.rgb, 0.0);
#ifdef LAYERS
    float lit = clamp(at.tree_sun.w, 0.0, 1.0);
    Shown shown = Shown(vec4(sun, trees), vec4(from_sky, trees), vec4(0.0, 0.0, trees * vec2(lit, 1.0 - lit)));
#else
    Shown shown = Shown(vec4(sun + from_sky, trees));
#endif
    return sum(shown, scaled(sky_at(pixel), 1.0 - trees));
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
        store_pixel(pixel, standing_before_sky(pixel, found >> 8u & 0xffu, found >> 16u, ivec2(size)));
    }
}
