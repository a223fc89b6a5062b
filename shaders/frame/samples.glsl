// Samples of a pixel, where Vulkan's standard sample locations put them.

const vec2 OFFSETS_4[4] = vec2[](vec2(-0.125, -0.375), vec2(0.375, -0.125), vec2(-0.375, 0.125), vec2(0.125, 0.375));
const vec2 OFFSETS_8[8] = vec2[](vec2(0.0625, -0.1875), vec2(-0.0625, 0.1875), vec2(0.3125, 0.0625), vec2(-0.1875, -0.3125),
                                 vec2(-0.3125, 0.3125), vec2(-0.4375, -0.0625), vec2(0.1875, 0.4375), vec2(0.4375, -0.4375));

// From the pixel's centre, pixels.
vec2 sample_offset(uint k, uint samples) { return samples == 8u ? OFFSETS_8[k & 7u] : samples == 4u ? OFFSETS_4[k & 3u] : vec2(0.0); }
