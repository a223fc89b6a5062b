// The tree that each sample of a tile sees. One workgroup a tile of 8 x 8 pixels; one invocation a column of them.
//
// First the tile's list becomes bits: for each pixel, of which of 32 trees it may see something. Then every invocation goes through its
// pixels, and each pixel through its own trees, front to back, until the farthest thing that one of its samples sees is nearer than
// the next tree can be. Long lists are gone through in parts; between parts the samples are in the buffer that holds the result.
#include "physics/masks.glsl"
#include "frame/trees/tiles/fetch.glsl"
#include "physics/zfield.glsl"
#include "forest/wind.glsl"
#include "frame/trees/zfield_space.glsl"
#include "frame/trees/tiles/order.glsl"
#include "frame/trees/tiles/sight.glsl"
#include "frame/trees/tiles/outline.glsl"
#include "frame/samples.glsl"
#include "frame/tile.glsl"

const uint PART = 1024u;       // trees of a part of a list
const uint WORDS = PART / 32u; // of bits a pixel
// Drivers end loops in silence after 65,535 turns of all loops of an invocation together (llvmpipe): before, a tile gives up aloud.
const uint MOST_TURNS = 60000u;

layout(local_size_x = 8) in;
layout(binding = 0) uniform usamplerBuffer records;
layout(binding = 1) uniform usamplerBuffer boxes;
layout(binding = 2) uniform usamplerBuffer entries;
layout(binding = 3) uniform usamplerBuffer ends;    // of the lists' parts
layout(std430, binding = 4) buffer State { TileState items[]; } state;
layout(std430, binding = 5) buffer Seen { uint items[]; } seen;     // trees, counted from 1
layout(std430, binding = 6) buffer Depths { float items[]; } depths; // of samples, in tiles whose list has several parts
layout(binding = 7) uniform sampler2DArray views;
layout(binding = 9) uniform usamplerBuffer outlines; // of views
layout(push_constant) uniform Push { TileParameters p; };
layout(constant_id = 0) const uint SAMPLES = 4u;
layout(constant_id = 1) const uint ESTIMATES = 1u;
layout(constant_id = 2) const bool SHORTCUTS = true; // without, hidden trees and all of their boxes are looked at too, to the same bits

// Of each pixel, which of 32 trees it may see: of a word of trees eight columns, of a column eight rows.
shared uint pixels[WORDS * 64u];
shared uint left; // whether a pixel may see trees of the next part

// All of the first rows of a tile, eight bits a row.
uvec2 first_rows(int rows) {
    ivec2 some = clamp(ivec2(rows, rows - 4), 0, 4);
    return uvec2(some.x == 4 ? ~0u : (1u << uint(8 * some.x)) - 1u, some.y == 4 ? ~0u : (1u << uint(8 * some.y)) - 1u);
}

// Pixels of a tile that may see a tree: of its box, and with `by_outline` of its outline.
uvec2 pixels_of(uint tree, uvec2 corner, bool by_outline) {
    uvec2 b = texelFetch(boxes, int(tree)).xy;
    ivec4 box = clamp(ivec4(b.x & 0xffffu, b.x >> 16u, b.y & 0xffffu, b.y >> 16u) - ivec4(corner, corner), ivec4(0), ivec4(8));
    uint columns = ((1u << uint(box.z)) - (1u << uint(box.x))) * 0x1010101u;
    uvec2 boxed = columns & first_rows(box.w) & ~first_rows(box.y);
    // No rows rather than no call, because drivers without branches run both sides of those.
    box.w = by_outline ? box.w : box.y;
    uvec2 outlined = outlined_pixels(outlines, unpack_sight(records, tree), vec2(corner), box);
    return by_outline ? outlined : boxed;
}

uint tree_at(bool whole, uint place, uint end) {
    place = min(place, end - 1u);
    return whole ? place : texelFetch(entries, int(place)).x;
}

// Swaps the upper parts of `a` with the lower of `b`.
void swap_parts(inout uint a, inout uint b, uint shift, uint mask) {
    uint other = (a >> shift ^ b) & mask;
    b ^= other;
    a ^= other << shift;
}

// Makes of eight words of eight nibbles their transpose.
void transpose_nibbles(inout uint m[8]) {
    for (int k = 0; k < 4; k++) swap_parts(m[k], m[k + 4], 16u, 0xffffu);
    for (int k = 0; k < 4; k++) swap_parts(m[k + (k & 2)], m[k + (k & 2) + 2], 8u, 0xff00ffu);
    for (int k = 0; k < 4; k++) swap_parts(m[2 * k], m[2 * k + 1], 4u, 0xf0f0f0fu);
}

// Eight bits as the lowest of eight nibbles.
uint spread(uint bits) {
    bits = (bits | bits << 12u) & 0xf000fu;
    bits = (bits | bits << 6u) & 0x3030303u;
    return (bits | bits << 3u) & 0x11111111u;
}

// Notes which trees of a part each pixel may see. Of 32 trees an invocation looks at four, one bit each of a nibble for every pixel,
// and gives them to the invocations of the pixels' columns, which put the eight nibbles of a pixel together. Returns the turns that this
// took at most. Long lists do without outlines: each row of a box would be a turn.
uint note_pixels(bool whole, uint begin, uint count, uint end, uvec2 corner, uint column, bool by_outline) {
    uint words = (count + 31u) / 32u;
    for (uint word = 0u; word < words; word++) {
        uint m[8] = uint[](0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u);
        for (uint k = 0u; k < 4u; k++) {
            uint place = word * 32u + column * 4u + k;
            uvec2 some = pixels_of(tree_at(whole, begin + place, end), corner, by_outline);
            some = place < count ? some : uvec2(0u);
            for (int row = 0; row < 8; row++) m[row] |= spread((row < 4 ? some.x : some.y) >> uint(8 * (row & 3)) & 0xffu) << k;
        }
        transpose_nibbles(m);
        for (uint k = 0u; k < 8u; k++) pixels[word * 64u + k * 8u + column] = m[k];
    }
    barrier();
    left = 0u;
    for (uint word = 0u; word < words; word++) {
        uint m[8];
        for (uint k = 0u; k < 8u; k++) m[k] = pixels[word * 64u + column * 8u + k];
        transpose_nibbles(m);
        for (uint row = 0u; row < 8u; row++) pixels[word * 64u + column * 8u + row] = m[row];
    }
    barrier();
    return (by_outline ? 6u + 4u * TILE_SIDE : 6u) * words;
}

// Samples of one tree at a pixel, and their depth as the depth buffer holds it.
uint sees(Sight s, vec2 pixel, out float depth) {
    vec2 d = pixel - s.pixel;
    float inverse_h = 1.0 + dot(s.tilt, d), h = 1.0 / inverse_h;
    vec2 ab = (s.start + vec2(dot(s.across.xy, d), dot(s.across.zw, d))) * h;
    float far = 1.0 / s.closeness;
    vec3 at[3], to[3];
    for (int k = 0; k < 3; k++) {
        at[k] = ab.x * s.right[k] + ab.y * s.up[k];
        to[k] = far * s.toward[k] - at[k];
    }
    vec3 w = vec3(s.weights, 1.0 - s.weights.x - s.weights.y);
    bool below = s.layers >> 31u != 0u;
    vec3 layers = unpack_layers(s.layers, s.first);
    uint before = s.draw < 2u ? ESTIMATES : 0u;
    Surface surface = zfield_search(views, at, to, layers, w, float(s.mip), s.draw == 0u ? 0u : before, s.draw == 0u ? before : 0u, below);
    float along = clamp(surface.s, -1e3, 0.999);
    float opacity = surface.s < 0.999 && inverse_h > 0.0 ? surface.opacity * s.fade : 0.0;
    depth = min(p.near / s.depth * inverse_h / (1.0 - along), 1.0);
    uint covered = covered_samples(opacity, s.dither, SAMPLES - s.mesh), mask = inner_column(s.row, covered, SAMPLES);
    if (s.mesh > 0u) mask = rest_mask(covered, s.mesh, uint(s.dither * 1024.0), SAMPLES);
    // The quad's edges part samples, as those of triangles do.
    uint within = 0u;
    for (uint k = 0u; k < SAMPLES; k++) {
        vec2 o = sample_offset(k, SAMPLES);
        vec2 c = ab + h * vec2(dot(s.across.xy, o), dot(s.across.zw, o));
        bool inside = c.x >= s.extent.x && c.x <= s.extent.y && c.y >= s.extent.z && c.y <= s.extent.w;
        within |= inside ? 1u << k : 0u;
    }
    return mask & within;
}

// A pixel's way through its trees.
struct Next {
    uint trees;  // bits of those of the current word that are left
    uint word;   // behind the current
    uint tree;   // to look at
    bool done;   // there is none
    bool hidden; // because all that its samples see is nearer than the next can be
};

// Goes on to the pixel's next tree; returns the turns that this took.
uint find_next(inout Next next, float farthest, bool whole, uint begin, uint words, uint end, uint column, uint row) {
    uint first = next.word;
    while (next.trees == 0u && next.word < words && !next.done) {
        next.trees = pixels[next.word * 64u + column * 8u + row];
        next.word++;
    }
    next.done = next.done || next.trees == 0u;
    uint k = (next.word - 1u) * 32u + uint(findLSB(max(next.trees, 1u)));
    next.tree = tree_at(whole, begin + (next.done ? 0u : k), end);
    next.trees &= next.trees - 1u;
    next.hidden = SHORTCUTS && !next.done && farthest * bin_depth(sight_bin(records, next.tree)) > p.near;
    next.done = next.done || next.hidden;
    return next.word - first;
}

void main() {
    uvec2 corner = tile_corner();
    uint column = gl_LocalInvocationIndex, turns = 0u;
    uvec2 list_at = corner >> p.list_shift;
    uint list = list_at.y * p.lists.x + list_at.x;
    bool whole = state.items[0].whole != 0u;
    uint first = 0u, end = state.items[0].tree_count;
    if (!whole) {
        first = list > 0u ? texelFetch(ends, int(list * p.list_lanes) - 1).x : 0u;
        end = texelFetch(ends, int((list + 1u) * p.list_lanes) - 1).x;
    }
    bool more = true, parted = end > first + PART;
    for (uint begin = first; more; begin += PART) {
        uint count = min(end - min(begin, end), PART), words = (count + 31u) / 32u;
        turns += note_pixels(whole, begin, count, end, corner, column, SHORTCUTS && !parted);
        bool open = false;
        for (uint row = 0u; row < TILE_SIDE; row++) {
            uvec2 pixel = corner + uvec2(column, row);
            bool inside = pixel.x < p.size.x && pixel.y < p.size.y;
            uint at = (min(pixel.y, p.size.y - 1u) * p.size.x + min(pixel.x, p.size.x - 1u)) * SAMPLES;
            float depth[8];
            uint tree_of[8];
            float farthest = 1.0;
            for (uint k = 0u; k < SAMPLES; k++) {
                depth[k] = ground_depth(ivec2(pixel), int(k));
                tree_of[k] = 0u;
            }
            // A loop of no turns or one, because drivers without branches run both sides of those.
            for (bool again = begin > first; again; again = false) {
                for (uint k = 0u; k < SAMPLES; k++) {
                    depth[k] = depths.items[at + k];
                    tree_of[k] = seen.items[at + k];
                }
            }
            for (uint k = 0u; k < SAMPLES; k++) farthest = min(farthest, depth[k]);
            // One loop over all words: invocations that are done with one go on to the next while others are not.
            Next next = Next(0u, 0u, 0u, !inside, false);
            turns += find_next(next, farthest, whole, begin, words, end, column, row);
            while (!next.done) {
                float z;
                uint mask = sees(unpack_sight(records, next.tree), vec2(pixel) + 0.5, z);
                farthest = 1.0;
                for (uint i = 0u; i < SAMPLES; i++) {
                    bool nearer = (mask >> i & 1u) != 0u && z >= depth[i];
                    depth[i] = nearer ? z : depth[i];
                    tree_of[i] = nearer ? next.tree + 1u : tree_of[i];
                    farthest = min(farthest, depth[i]);
                }
                turns += 1u + find_next(next, farthest, whole, begin, words, end, column, row);
            }
            open = open || (inside && !next.hidden);
            for (uint k = 0u; k < SAMPLES; k++) {
                if (inside) seen.items[at + k] = tree_of[k];
            }
            for (bool again = inside && parted; again; again = false) {
                for (uint k = 0u; k < SAMPLES; k++) depths.items[at + k] = depth[k];
            }
        }
        if (open) atomicOr(left, 1u);
        barrier();
        more = parted && begin + PART < end && left != 0u;
        if (turns > MOST_TURNS) state.items[0].overrun = 1u;
    }
}
