// Which trees beyond the hand-over stay, because they stand out from the ground. The shader-map on the terrain that takes
// over has no thickness: ridges against the sky or against far ground would lose their trees. Twin, to the bit:
// src/land/silhouette.rs. So everything is `precise`, in a fixed order, and without divisions or square roots, which
// devices round differently.

const uint SILHOUETTE_STEPS = 7u;
const uint SILHOUETTE_CANOPY_STEP = 4u; // first step at which the sight line must have left the canopy

// 1 / sqrt(x), relative error under 5e-7: Newton's iteration for 1/y^2 - x from a guess that halves the exponent.
float reciprocal_root(float x) {
    precise float y = uintBitsToFloat(0x5f3759dfu - (floatBitsToUint(x) >> 1u));
    precise float h = 0.5 * x;
    for (int k = 0; k < 3; k++) {
        precise float e = 1.5 - (h * y) * y;
        y = y * e;
    }
    return y;
}

// Height of the ground at a position in height map texels, bilinear. Beyond the terrain there is none: to be continuous
// in the position, it falls by 4 m a metre from the border on.
float ground_height(sampler2DArray heights, vec2 position, float cell) {
    ivec2 last = textureSize(heights, 0).xy - 1;
    vec2 inside = clamp(position, vec2(0.0), vec2(last));
    vec2 low = floor(inside);
    ivec2 a = ivec2(low), b = min(a + 1, last);
    precise vec2 f = inside - low;
    float h00 = texelFetch(heights, ivec3(a, 0), 0).r, h10 = texelFetch(heights, ivec3(b.x, a.y, 0), 0).r;
    float h01 = texelFetch(heights, ivec3(a.x, b.y, 0), 0).r, h11 = texelFetch(heights, ivec3(b, 0), 0).r;
    precise float south = h00 + f.x * (h10 - h00);
    precise float north = h01 + f.x * (h11 - h01);
    precise vec2 outside = abs(position - inside);
    precise float height = (south + f.y * (north - south)) - (outside.x + outside.y) * (4.0 * cell);
    return height;
}

// How far sight lines from the camera to the tree pass above the ground, m: the least of the following and of half the
// tree's height; of no interest once it is not above 0. With L the step and t = L 2^k:
//
// - t behind the tree, the line through its top: how much of the tree stands out. Before ground that is no farther than
//   64 L, the shader-map shows it.
// - t before the tree, nearer than 16 L, the line half a tree's height above its top: ground as high as that hides the tree,
//   and it has gone from full opacity to none behind that ground.
// - t before the tree, from 16 L on, the line half a tree's height under its base: the one through its centre has then left
//   the canopy. Trees of level ground seen at a grazing angle hide each other, and would all stay.
//
// Continuous in the camera's position, as the tree's opacity must be. `asked`: false gives 0 at no cost.
float silhouette(View v, SeedQuad q, Seed s, vec3 centre, float height, sampler2DArray heights, bool asked) {
    precise float d2 = centre.x * centre.x;
    d2 = d2 + centre.y * centre.y;
    d2 = d2 + centre.z * centre.z;
    precise float u = v.silhouette_step * reciprocal_root(d2);
    precise float top = centre.z + 0.5 * height;
    precise float least = asked ? 0.5 * height : 0.0;
    // The exit depends on data: drivers that run both sides of branches skip the rest of a loop.
    for (uint k = 0u; k < SILHOUETTE_STEPS && least > 0.0; k++) {
        precise vec2 behind = s.position + centre.xy * u;
        precise vec2 texel = vec2(q.texel) + (q.texel_offset + behind * v.cells_per_metre);
        precise float ground = ground_height(heights, texel, v.height_cell) - v.camera_height;
        precise float clear = (top + top * u) - ground;
        least = min(least, clear);
        // No nearer the camera than half way.
        float w = min(u, 0.5);
        precise vec2 before = s.position - centre.xy * w;
        texel = vec2(q.texel) + (q.texel_offset + before * v.cells_per_metre);
        ground = ground_height(heights, texel, v.height_cell) - v.camera_height;
        precise float end = k < SILHOUETTE_CANOPY_STEP ? centre.z + height : centre.z - height;
        clear = (end - end * w) - ground;
        least = min(least, clear);
        u = u + u;
    }
    return least;
}

// Opacity of a tree on a silhouette with that clearance.
float silhouette_opacity(float clearance, float height) { return smoothstep(0.0, 0.5, clearance / height); }
