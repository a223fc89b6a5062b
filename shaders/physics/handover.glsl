// From trees drawn one by one to the shader-map (BN12, section 7). Twin: src/physics/handover.rs, where the forms are
// derived. `relative` is the distance over that at which a species is no longer drawn tree by tree (s / s_max).
// Needs interface.glsl.

// Distance over the range. Where there is none, everything is handed over: as at its end.
float relative_distance(float distance, float range) { return range > 0.0 ? distance / range : 1.0; }

// How far light and ground have converged to their averages: nu of BN12, eq. 22-25; `end` is 0.8 there, and 0 where they never do.
float converged(float relative, float end) { return end > 0.0 ? smoothstep(0.0, end, relative) : 0.0; }

// Share of the trees that the shader-map shows: mean of 1 - tree_fade over u.
vec4 handed_over(vec4 relative) {
    vec4 t = clamp((relative - HANDOVER_FROM) * HANDOVER_RATE, 0.0, 1.0);
    return mix(1.0 - 2.0 * (1.0 - t) * (1.0 - t), 2.0 * t * t, lessThan(t, vec4(0.5)));
}
float handed_over(float relative) { return handed_over(vec4(relative)).x; }

// Relative distance at which one tree has faded out; each does so at a time of its own, u in [0, 1). `precise` lets the
// CPU's twin of the cull agree to the bit.
float fade_end(float u) {
    precise float end = FADE_FIRST + FADE_SPREAD * u;
    return end;
}

// Its opacity factor.
float tree_fade(float relative, float u) { return clamp((fade_end(u) - relative) * FADE_RATE, 0.0, 1.0); }

// What the trees of the shader-map leave of the ground: exp(-handed over optical thickness), and where discs of single
// trees can be told apart, only between them. Linear in the coverage, whose mean is `expected`: so is its mean right.
float open_ground(float thickness, float over, float coverage, float expected) {
    // Only the last of the hand-over tells discs apart: before, the trees themselves do.
    float share = over * over;
    float between = share * share * ((expected - coverage) / max(1.0 - expected, 1.0 / 64.0));
    return clamp(exp(-thickness) * (1.0 + between), 0.0, 1.0);
}
