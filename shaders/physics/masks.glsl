// Sub-pixel coverage masks (BN12, section 8). Twin: src/physics/masks.rs.

// Number of samples covered by opacity alpha: alpha * samples rounded up or down, with the fraction as the
// probability of rounding up over a uniform dither, so that the expected coverage is alpha exactly.
uint covered_samples(float alpha, float dither, uint samples) {
    return uint(clamp(floor(alpha * float(samples) + dither), 0.0, float(samples)));
}

// So many samples in turn from one on, around the end.
uint run_mask(uint count, uint first, uint samples) {
    uint run = (1u << count) - 1u;
    return (run << first | run >> (samples - first)) & ((1u << samples) - 1u);
}

// The samples in which a tree is its mesh: so many from one on that the lower bits of its dither choose. In the others it is its z-field.
// Both sides of the hand-over ask here, so that no sample has both or none.
uint mesh_mask(uint count, uint dither_bits, uint samples) { return run_mask(count, dither_bits & (samples - 1u), samples); }

// Samples that its z-field covers: so many of those that the mesh leaves.
uint rest_mask(uint covered, uint count, uint dither_bits, uint samples) {
    uint rest = max(samples - count, 1u), first = ((dither_bits & (samples - 1u)) + count) & (samples - 1u);
    uint some = run_mask(min(covered, rest), (dither_bits >> 3u) % rest, rest);
    return (some << first | some >> (samples - first)) & ((1u << samples) - 1u);
}

// Column k of a tree's row of the combination table: samples + 1 masks of `samples` bits, packed low first.
uint mask_column(uvec3 row, uint k, uint samples) {
    uint bit = k * samples;
    uint word = bit < 32u ? row.x : (bit < 64u ? row.y : row.z);
    return (word >> (bit & 31u)) & ((1u << samples) - 1u);
}
