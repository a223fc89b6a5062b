// Trees front to back: a stable counting sort by the nearest depth that a tree can have. Bins are the upper bits of the depth's
// float, 32 an octave: monotonic, and exact to take apart again.

const uint DEPTH_SHIFT = 18u;                    // mantissa bits below the bin
const uint DEPTH_FIRST = (127u - 6u) << 5u;      // bin of 1/64 m

uint depth_bin(float depth) {
    uint bits = floatBitsToUint(max(depth, 1.0 / 64.0)) >> DEPTH_SHIFT;
    return min(bits - DEPTH_FIRST, DEPTH_BINS - 1u);
}

// Least depth of a bin; trees in the first may be nearer.
float bin_depth(uint bin) { return bin == 0u ? 0.0 : uintBitsToFloat((bin + DEPTH_FIRST) << DEPTH_SHIFT); }

// The same for lists, each of the tiles in a square of pixels: first column and row, and those behind the last.
uvec4 box_lists(uvec4 box, uint shift) { return uvec4(box.xy >> shift, (box.zw + ((1u << shift) - 1u)) >> shift); }
