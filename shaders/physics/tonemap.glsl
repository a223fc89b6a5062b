// Display transform. Twin: src/physics/tonemap.rs.

// x (1 + x / w2) / (1 + x) of Reinhard et al. 2002 eq. 4, on the luminance, white at 4.
vec3 tone_curve(vec3 c) {
    float l = dot(max(c, vec3(0.0)), vec3(0.2126, 0.7152, 0.0722));
    float mapped = (1.0 + l * (1.0 / 16.0)) / (1.0 + l);
    return clamp(c * mapped, 0.0, 1.0);
}

// Linear to sRGB (IEC 61966-2-1).
vec3 srgb(vec3 c) {
    return mix(12.92 * c, 1.055 * pow(max(c, vec3(1e-8)), vec3(1.0 / 2.4)) - 0.055, vec3(greaterThan(c, vec3(0.0031308))));
}
