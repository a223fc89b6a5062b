// The distinct things that the samples of a tile's pixels see, column by column: what a pass then lights once each. Whoever includes this
// says what a sample sees, with sample_sees(pixel, sample): 0, nothing of the pass's. Needs frame/shown.glsl.
#include "frame/column_items.glsl"

const uint MOST_ITEMS = TILE_SIDE * 8u; // of a column: one a sample, of up to eight

shared uint ranks[8u * MOST_ITEMS];  // what is seen
shared uint places[8u * MOST_ITEMS]; // samples that see it; row of the pixel << 8
shared Shown shown[8u * MOST_ITEMS]; // what it shows to the pixel, once it is lit

// Lists what this invocation's column sees.
void list_items(uvec2 corner, uint column) {
    uint count = 0u, first_item = column * MOST_ITEMS;
    for (uint row = 0u; row < TILE_SIDE; row++) {
        uvec2 pixel = corner + uvec2(column, row);
        bool inside = pixel.x < p.size.x && pixel.y < p.size.y;
        ivec2 within = ivec2(min(pixel, p.size - 1u));
        uint sees[8];
        for (uint k = 0u; k < SAMPLES; k++) sees[k] = inside ? sample_sees(within, int(k)) : 0u;
        for (uint k = 0u; k < SAMPLES; k++) {
            bool first = sees[k] != 0u;
            uint samples = 0u;
            for (uint i = 0u; i < SAMPLES; i++) {
                first = first && (i >= k || sees[i] != sees[k]);
                samples |= sees[i] == sees[k] ? 1u << i : 0u;
            }
            if (first) {
                ranks[first_item + count] = sees[k];
                places[first_item + count] = samples | row << 8u;
                count++;
            }
        }
    }
    counts[column] = count;
}

// The pixel of an item.
ivec2 item_pixel(uvec2 corner, uint slot) { return ivec2(corner + uvec2(slot / MOST_ITEMS, places[slot] >> 8u)); }

// What the items of a row's pixel show together, each in its samples; `item` is a column's next, before its `end`, and goes on behind them. Also the samples
// that see any, and which item the first of a pixel's sees, ~0 where it sees none.
Shown row_shown(uint row, uint end, inout uint item, out uint covered, out uint first) {
    Shown all = shown_nothing();
    covered = 0u;
    first = ~0u;
    while (item < end && places[item] >> 8u == row) {
        uint samples = places[item] & 0xffu;
        all = sum(all, scaled(shown[item], float(bitCount(samples)) / float(SAMPLES)));
        first = (samples & 1u) != 0u ? item : first;
        covered |= samples;
        item++;
    }
    return all;
}
