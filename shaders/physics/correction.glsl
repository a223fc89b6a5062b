// What the laws of a crown's light leave out, by the directions of viewer and sun and by height. Twin: src/physics/correction.rs.

// Terms Y, of the cosines of the zenith angles of viewer and sun and the phase angle: 1, q, q2, l, and l2, v, vq, lq.
struct CorrectionTerms {
    vec4 first, second;
};

CorrectionTerms correction_terms(float view, float sun, float angle) {
    float v = clamp(view, 0.0, 1.0), l = clamp(sun, 0.0, 1.0), q = sqrt(angle * (1.0 / 3.141592653589793));
    return CorrectionTerms(vec4(1.0, q, q * q, l), vec4(l * l, v, v * q, l * q));
}

// For light that is known at the surfaces themselves: hats of q about 0, 1/5, ... 1, and l, v.
CorrectionTerms phase_terms(float view, float sun, float angle) {
    float x = 5.0 * sqrt(angle * (1.0 / 3.141592653589793));
    vec4 near = max(1.0 - abs(x - vec4(0.0, 1.0, 2.0, 3.0)), 0.0);
    vec2 far = max(1.0 - abs(x - vec2(4.0, 5.0)), 0.0);
    return CorrectionTerms(near, vec4(far, clamp(vec2(sun, view), 0.0, 1.0)));
}

// K as a line in the height z: its value at 0, and its slope; of the coefficients at the middle of the tree and of their change.
vec2 correction_line(vec4 coefficients[4], CorrectionTerms y, float strength) {
    return vec2(1.0, 0.0) + strength * vec2(dot(coefficients[0], y.first) + dot(coefficients[1], y.second),
                                            dot(coefficients[2], y.first) + dot(coefficients[3], y.second));
}

// K of the sun on slices of a forest at a share of the full density.
float shell_correction(vec4 c[5], CorrectionTerms y, float share) {
    float l = y.second.z, v = y.second.w;
    vec2 more = vec2(l * l * l * l, v * v);
    vec4 first = c[0] + share * c[3], second = c[1] + share * c[4];
    return max(1.0 + dot(first, y.first) + dot(second, y.second) + dot(c[2], vec4(more, share * more)), 0.0);
}

// K at a height.
float correction_at(vec2 line, float z) { return max(line.x + line.y * z, 0.0); }
