// Light from the sun's direction to what texels show, on top of the crown's law (precomputed radiance transfer). Twin:
// src/physics/transfer.rs.

// How much of it there is at a phase angle, given its root.
float transfer_strength(float root) { return 1.0 - exp(-root); }

// The coefficients of a sampled colour: bytes are 32 (x + 4).
vec4 transfer_decode(vec4 sampled) { return sampled * (255.0 / 32.0) - 4.0; }

// Terms of the first band, and of the second, at a unit vector in the tree's own axes.
vec4 transfer_first(vec3 l) { return vec4(1.0, l); }
vec4 transfer_second(vec3 l) { return vec4(l.x * l.y, l.y * l.z, l.x * l.z, l.x * l.x - l.y * l.y); }

// M is max(1 + strength x, 0), with x the sum over bands of terms times coefficients. A band's at a point that was found in the
// views: p + s d, of which each view shows its share (they sum to 1).
float transfer_fetch(sampler2DArray band, vec4 terms, vec3 p[3], vec3 d[3], vec3 layers, vec3 shares, float mip, float s) {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 3; i++) {
        vec2 uv = p[i].xy + s * d[i].xy + 0.5;
        sum += shares[i] * textureLod(band, vec3(uv, layers[i]), mip);
    }
    return dot(transfer_decode(sum), terms);
}
