// Local density of a species. Needs `densities` (one layer a map) and `species` to be declared before.

layout(constant_id = 2) const uint DENSITY_MAPS = 1u; // 0: no species has a map

// Relative density of the map at a position, bilinear between texel centres; 1 without a map.
float density_map(Species s, vec2 position, vec2 extent) {
    if (DENSITY_MAPS == 0u || s.density_layer == NO_PAGE) return 1.0;
    vec2 t = clamp(position / extent, 0.0, 1.0) * s.map_size - 0.5;
    vec2 cell = floor(t), f = t - cell;
    ivec2 last = ivec2(s.map_size) - 1;
    ivec2 a = clamp(ivec2(cell), ivec2(0), last), b = clamp(ivec2(cell) + 1, ivec2(0), last);
    int layer = int(s.density_layer);
    float d00 = texelFetch(densities, ivec3(a, layer), 0).r, d10 = texelFetch(densities, ivec3(b.x, a.y, layer), 0).r;
    float d01 = texelFetch(densities, ivec3(a.x, b.y, layer), 0).r, d11 = texelFetch(densities, ivec3(b, layer), 0).r;
    return mix(mix(d00, d10, f.x), mix(d01, d11, f.x), f.y);
}

// Share of its density that a species has at this height and slope, the tangent of the ground's inclination.
float density_limits(Species s, float height, float slope) {
    vec2 lo = s.between_heights.x + s.height_softness * vec2(-1.0, 1.0);
    vec2 hi = s.between_heights.y + s.height_softness * vec2(-1.0, 1.0);
    float t = s.below_slope;
    return smoothstep(lo.x, lo.y, height) * (1.0 - smoothstep(hi.x, hi.y, height)) *
           (1.0 - smoothstep(t - s.slope_softness, t + s.slope_softness, slope));
}

// Trees per m2 of horizontal ground that the species' density asks for; none of a listed species.
float local_density(Species s, vec2 position, vec2 extent, float height, float slope) {
    return s.max_density * density_map(s, position, extent) * density_limits(s, height, slope);
}

// The same with the listed trees, as a density.
float horizontal_density(Species s, vec2 position, vec2 extent, float height, float slope) {
    float wanted = s.max_density * density_limits(s, height, slope);
    return (wanted + s.listed_density) * density_map(s, position, extent);
}
