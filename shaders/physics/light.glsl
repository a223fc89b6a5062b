// Light at leaves and on the ground (BN12, section 5). Twin: src/physics/light.rs.

const float PI = 3.141592653589793;

// Angle between two unit vectors. atan2 keeps its precision at 0 and pi, where acos loses it.
// Of the same direction it is 0 exactly: where a product and a difference become one operation a rounding stays of what should be nothing.
float angle_between(vec3 a, vec3 b) {
    precise vec3 across = a.yzx * b.zxy - a.zxy * b.yzx;
    return atan(length(across), dot(a, b));
}

// 1 where the sun is above the slope's horizon, smoothly 0 within two degrees of it. Twin: src/physics/tables.rs.
float sun_facing(vec3 l, vec3 n) { return smoothstep(0.0, 0.0349, dot(l, n)); }

// Reflectance of a crown at a phase angle: seen from beside the light, more of its leaves show their unlit side than uniform
// ones would.
vec3 turned_reflectance(vec3 reflectance, float turning, float angle) { return reflectance * max(1.0 + turning * angle, 0.0); }

// Leaf-scale hotspot (BN12, eq. 8): 1 - a1 (1 - exp(-a2 angle)), largest at v = l.
float hotspot(vec3 v, vec3 l, float a1, float a2) {
    return 1.0 - a1 * (1.0 - exp(-a2 * angle_between(v, l)));
}

// Share of a crown's visible surface that the crown itself leaves lit, at a phase angle, after the light's way through it:
// exp(-sqrt(angle) (c + sqrt(tau metres))), of c sqrt(angle) and tau angle, which are the same all over a tree.
float self_shadow(float leaf, float extinction, float metres) {
    return exp(-(leaf + sqrt(max(extinction * metres, 0.0))));
}

// Radiance of fully lit, uniformly oriented bi-Lambertian leaves per irradiance: rho p of BN12 eq. 7 from reflectance r
// and transmittance t. Ross (1981): Gamma = (r + t) (sin b - b cos b) / (3 pi) + t cos b / 3 with b the angle between
// the light's propagation (-l) and v, and radiance 2 Gamma / pi because leaves extinguish half their area per volume.
vec3 leaf_phase(vec3 v, vec3 l, vec3 r, vec3 t) {
    float b = PI - angle_between(v, l);
    float s = sin(b), c = cos(b);
    vec3 gamma = (r + t) * ((s - b * c) / (3.0 * PI)) + t * (c / 3.0);
    return max(gamma, vec3(0.0)) * (2.0 / PI);
}

// Of leaves of uniform orientation whose sides a viewer sees, weighed by what he sees of them, at a phase angle: the mean irradiance of either side, over
// that of all leaves; and the share of it that is on the side that is seen. Means of |n v| |n l| over the sphere where both are of one
// sign and where they are not: (sin a + (pi - a) cos a) and (sin a - a cos a), to the same factor (Ross 1981).
vec2 side_seen(float a) {
    float s = sin(a), c = cos(a), same = s + (PI - a) * c, both = same + s - a * c;
    return vec2(both * (4.0 / (3.0 * PI)), same / both);
}

// Sky seen from depth d on the axis of a cylindrical hole (BN12, eq. 9): 1 / (1 + d2 / r2), with 1 / r2 given.
float hole_occlusion(float d, float inverse_r2) { return 1.0 / (1.0 + d * d * inverse_r2); }

// Sine of a slope's angle, from the cosine.
float slope_sine(float up) { return max(sqrt(max(1.0 - up * up, 0.0)), 1e-3); }

// Sky on the ground of a slope, of what trees leave of the whole hemisphere about its normal: what lies under the horizon brings nothing.
float ground_sky(float up, float visible, float thickness) {
    return max(visible - 0.5 * (1.0 - up) * exp(-1.5 * thickness * up / slope_sine(up)), 0.0);
}

// Sky on a tree on that slope over that on one of level ground: the slope hides a lune.
float sky_over_slope(float up, float thickness) {
    return 1.0 - atan(slope_sine(up), up) / PI * exp(-0.75 * thickness * up / slope_sine(up));
}

// Contrast of the ground near trees (BN12, eq. 10): mean 1 where the expected coverage is right; never negative.
float ground_contrast(float coverage, float expected, float a3) { return max(1.0 - a3 * (coverage - expected), 0.0); }
