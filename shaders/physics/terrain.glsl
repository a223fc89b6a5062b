// Height and slope of the ground: bicubic Catmull-Rom interpolation of the height map. Twin: src/physics/terrain.rs.

// Weights of the four samples around fraction f, and of their derivative.
vec4 catmull_rom(float f) {
    return vec4(f * (-0.5 + f * (1.0 - 0.5 * f)), 1.0 + f * f * (1.5 * f - 2.5), f * (0.5 + f * (2.0 - 1.5 * f)),
                f * f * (0.5 * f - 0.5));
}
vec4 catmull_rom_slope(float f) {
    return vec4(-0.5 + f * (2.0 - 1.5 * f), f * (4.5 * f - 5.0), 0.5 + f * (4.0 - 4.5 * f), f * (1.5 * f - 1.0));
}

// Height (x) and its derivatives east and north per texel (y, z) at `cell + f`; samples outside repeat the border.
vec3 height_and_slope(sampler2DArray heights, ivec2 cell, vec2 f) {
    ivec2 last = textureSize(heights, 0).xy - 1;
    ivec2 shift = ivec2(floor(f));
    cell += shift;
    f -= vec2(shift);
    vec4 wx = catmull_rom(f.x), wy = catmull_rom(f.y), dx = catmull_rom_slope(f.x), dy = catmull_rom_slope(f.y);
    vec3 sum = vec3(0.0);
    for (int j = 0; j < 4; j++) {
        float row = 0.0, slope = 0.0;
        for (int i = 0; i < 4; i++) {
            float h = texelFetch(heights, ivec3(clamp(cell + ivec2(i - 1, j - 1), ivec2(0), last), 0), 0).r;
            row += wx[i] * h;
            slope += dx[i] * h;
        }
        sum += vec3(wy[j] * row, wy[j] * slope, dy[j] * row);
    }
    return sum;
}
