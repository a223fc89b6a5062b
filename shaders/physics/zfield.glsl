// z-fields: surfaces along a ray from three depth views (BN12, section 5). Twin: src/physics/zfield.rs.
//
// All is in scaled tree space, where the tree fits the cylinder r <= 1, |z| <= 1. A ray is p + s d. A view i maps a
// point to m_i = (u - 1/2, v - 1/2, depth), linearly, so that m_i(p + s d) = m_i(p) + s m_i(d): callers pass these two.
// Texels are (nearest depth, farthest depth, occlusion) times opacity, opacity; depths stored as (d + sqrt 2) / (2 sqrt 2).

const float SQRT2 = 1.4142135623730951;

struct Surface {
    float s;          // along the ray; 0 where nothing is
    float opacity;
    float occlusion;  // sky visibility in the isolated tree
};

// One fetch from each view at p + s d. Each view's surface is at s_i = (z_i - depth_i(p)) / depth_i(d); their mean is
// weighted by opacity, which premultiplied texels give without a division each.
Surface zfield_fetch(sampler2DArray views, vec3 p[3], vec3 d[3], vec3 layers, vec3 weights, float mip, float s,
                     bool farthest) {
    float sum_s = 0.0, opacity = 0.0, occlusion = 0.0;
    for (int i = 0; i < 3; i++) {
        vec2 uv = p[i].xy + s * d[i].xy + 0.5;
        vec4 t = textureLod(views, vec3(uv, layers[i]), mip);
        float z = (farthest ? t.g : t.r) * (2.0 * SQRT2) - SQRT2 * t.a;
        sum_s += weights[i] * (z - t.a * p[i].z) / d[i].z;
        opacity += weights[i] * t.a;
        occlusion += weights[i] * t.b;
    }
    float inverse = opacity > 0.0 ? 1.0 / opacity : 0.0;
    return Surface(sum_s * inverse, opacity, min(occlusion * inverse, 1.0));
}

// Three 10-bit layers, as floats for the sampler.
vec3 unpack_layers(uint packed, uint first) {
    return vec3(uvec3(packed, packed >> 10u, packed >> 20u) & 0x3ffu) + float(first);
}
