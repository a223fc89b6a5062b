// What light does to the two sides of a surface whose transfer is known as spherical harmonics (Sloan et al. 2002). Needs
// physics/harmonics.glsl.

// Of the sun and of an even sky of radiance 1, what the side that is seen receives and what the other does, W/m2.
struct Received {
    vec2 sun, sky;
};

// Nine coefficients of either side, in the axes in which `sun` points to the sun; `zonal` are the sky's three of order 0.
Received received(float seen_side[9], float other_side[9], vec3 sun, vec3 zonal) {
    float y[9];
    harmonics(sun, y);
    vec2 lit = vec2(0.0);
    for (int i = 0; i < 9; i++) lit += y[i] * vec2(seen_side[i], other_side[i]);
    vec2 open = zonal.x * vec2(seen_side[0], other_side[0]) + zonal.y * vec2(seen_side[2], other_side[2]) + zonal.z * vec2(seen_side[6], other_side[6]);
    // Few bands ring: less than nothing is nothing.
    return Received(max(lit, 0.0), max(open, 0.0));
}
