// Light that met more than one surface, from the nodes of a species' forest. Twin: src/physics/indirect.rs, where what the terms are is told.
// A node has its coefficients one after the other, a texel each.

// Terms of the sun; and where in a node the sky's on near trees begin, the open sky's, and far trees'; and how many there are.
const int INDIRECT_SUN = 10, INDIRECT_SKY = 15, INDIRECT_OPEN = 20, INDIRECT_FAR = 36, INDIRECT_NODE = 49;
const int INDIRECT_GROUND = 4;       // texels of a node of the ground
const float INDIRECT_NAMED = 0.5;    // height at which a tree's light has its colour

// By height: colour max(1 + profile.x (z - 1/2) + profile.y (z2 - 1/4), 0).
struct Handed {
    vec3 colour;
    vec2 profile;
};

// Where between its nodes a density is: the first node, and the part of the way to the second.
struct IndirectAt {
    int first;
    float part;
};

// Of an optical thickness x, of which the last node has `x_max`.
IndirectAt indirect_at(float x, float x_max, int nodes) {
    float at = float(nodes - 1) * sqrt(clamp(x / max(x_max, 1e-9), 0.0, 1.0)), first = clamp(floor(at), 0.0, float(nodes - 2));
    return IndirectAt(int(first), at - first);
}

// Coefficient `k` of nodes that begin at `base`.
vec3 indirect_coefficient(samplerBuffer nodes, int base, IndirectAt at, int stride, int k) {
    int i = base + at.first * stride + k;
    return mix(texelFetch(nodes, i).rgb, texelFetch(nodes, i + stride).rgb, at.part);
}

// Terms of the sun: cosines of the zenith angles of viewer and sun, and of the angle between them.
void indirect_sun_terms(float v, float l, float q, out float y[INDIRECT_SUN]) {
    y = float[](1.0, l, l * l, v, v * v, q, q * q, v * l, q * l, q * v);
}

float indirect_luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }

Handed handed_by(vec3 colour, vec3 rise, vec3 bend) {
    vec3 c = max(colour + INDIRECT_NAMED * (rise + INDIRECT_NAMED * bend), 0.0);
    float bright = max(indirect_luminance(c), 1e-9);
    return Handed(c, clamp(vec2(indirect_luminance(rise), indirect_luminance(bend)) / bright, -1e4, 1e4));
}

// What a near tree sends per irradiance of the sun, and per radiance of the sky.
Handed indirect_near_sun(samplerBuffer nodes, int base, IndirectAt at, float v, float l, float q) {
    float y[INDIRECT_SUN];
    indirect_sun_terms(v, l, q, y);
    vec3 colour = vec3(0.0), c[5];
    for (int i = 0; i < INDIRECT_SUN; i++) colour += y[i] * indirect_coefficient(nodes, base, at, INDIRECT_NODE, i);
    for (int i = 0; i < 5; i++) c[i] = indirect_coefficient(nodes, base, at, INDIRECT_NODE, INDIRECT_SUN + i);
    return handed_by(colour, c[0] + l * c[1] + v * c[2], c[3] + l * c[4]);
}

Handed indirect_near_sky(samplerBuffer nodes, int base, IndirectAt at, float v) {
    vec3 c[5];
    for (int i = 0; i < 5; i++) c[i] = indirect_coefficient(nodes, base, at, INDIRECT_NODE, INDIRECT_SKY + i);
    return handed_by(c[0] + v * (c[1] + v * c[2]), c[3], c[4]);
}

// What there is of the sky's light among other trees, over what a tree's z-field knows of it, at heights -3/4, -1/4, 1/4 and 3/4.
vec4 indirect_open(samplerBuffer nodes, int base, IndirectAt at, float v) {
    float up = clamp(0.5 - 5.0 * v, 0.0, 1.0); // the viewer looks, from the ground
    vec4 open, sides = vec4(1.0 - up, (1.0 - up) * v, up, up * v);
    for (int k = 0; k < 4; k++) {
        vec3 c = vec3(0.0);
        for (int s = 0; s < 4; s++) c += sides[s] * indirect_coefficient(nodes, base, at, INDIRECT_NODE, INDIRECT_OPEN + 4 * s + k);
        open[k] = min(max(c.x, 0.0) / max(c.y, 1e-6), 4.0);
    }
    return open;
}

// Between these heights, and beyond as there.
float open_at(vec4 open, float z) {
    vec4 tents = max(1.0 - abs(clamp(2.0 * z + 1.5, 0.0, 3.0) - vec4(0.0, 1.0, 2.0, 3.0)), 0.0);
    return dot(open, tents);
}

uvec2 pack_open(vec4 open) { return uvec2(packHalf2x16(open.xy), packHalf2x16(open.zw)); }
vec4 unpack_open(uvec2 packed) { return vec4(unpackHalf2x16(packed.x), unpackHalf2x16(packed.y)); }

// What of far trees is seen.
vec3 indirect_far_sun(samplerBuffer nodes, int base, IndirectAt at, float v, float l, float q) {
    float y[INDIRECT_SUN];
    indirect_sun_terms(v, l, q, y);
    vec3 colour = vec3(0.0);
    for (int i = 0; i < INDIRECT_SUN; i++) colour += y[i] * indirect_coefficient(nodes, base, at, INDIRECT_NODE, INDIRECT_FAR + i);
    return max(colour, 0.0);
}

vec3 indirect_far_sky(samplerBuffer nodes, int base, IndirectAt at, float v) {
    vec3 c[3];
    for (int i = 0; i < 3; i++) c[i] = indirect_coefficient(nodes, base, at, INDIRECT_NODE, INDIRECT_FAR + INDIRECT_SUN + i);
    return max(c[0] + v * (c[1] + v * c[2]), 0.0);
}

// What trees send to the ground over pi, per irradiance of the sun, and per radiance of the sky.
vec3 indirect_ground_sun(samplerBuffer nodes, IndirectAt at, float l) {
    vec3 c[3];
    for (int i = 0; i < 3; i++) c[i] = indirect_coefficient(nodes, 0, at, INDIRECT_GROUND, i);
    return max(c[0] + l * (c[1] + l * c[2]), 0.0);
}

vec3 indirect_ground_sky(samplerBuffer nodes, IndirectAt at) { return max(indirect_coefficient(nodes, 0, at, INDIRECT_GROUND, 3), 0.0); }

// A tree's light in two words: 9 bits of each colour over a common exponent as RGB9E5 has it, and two halves.
uvec2 pack_handed(Handed h) {
    float largest = max(max(h.colour.r, h.colour.g), max(h.colour.b, 1e-9));
    float exponent = clamp(floor(log2(largest)) + 1.0, -15.0, 16.0), unit = exp2(exponent - 9.0);
    // Rounding may bring the largest to 512: then it is half that of the next exponent.
    if (floor(largest / unit + 0.5) > 511.0) {
        exponent = min(exponent + 1.0, 16.0);
        unit = exp2(exponent - 9.0);
    }
    uvec3 bits = uvec3(clamp(floor(h.colour / unit + 0.5), 0.0, 511.0));
    return uvec2(bits.r | bits.g << 9u | bits.b << 18u | uint(exponent + 15.0) << 27u, packHalf2x16(h.profile));
}

// Of it, what there is at a height.
vec3 handed_at(uvec2 packed, float z) {
    vec3 colour = vec3(uvec3(packed.x, packed.x >> 9u, packed.x >> 18u) & 511u) * exp2(float(packed.x >> 27u) - 24.0);
    vec2 profile = unpackHalf2x16(packed.y);
    return colour * max(1.0 + profile.x * (z - INDIRECT_NAMED) + profile.y * (z * z - INDIRECT_NAMED * INDIRECT_NAMED), 0.0);
}
