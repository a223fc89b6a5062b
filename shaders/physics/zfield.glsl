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

// Depth by which a view may disagree with the point found so far before it counts half.
const float AGREEMENT = 0.15;

// One fetch from each view at q = p + s d. Each view's surface is at s_i = (z_i - depth_i(p)) / depth_i(d); their mean is
// weighted by opacity, which premultiplied texels give without a division each. Where q is more than a first guess, a view
// whose surface lies far from it shows another branch, and loses weight: k_i = w_i (1 - a_i e_i / (1 + e_i)) with
// e_i = ((z_i - depth_i(q)) / AGREEMENT)^2.
Surface zfield_fetch(sampler2DArray views, vec3 p[3], vec3 d[3], vec3 layers, vec3 weights, float mip, float s,
                     bool farthest, bool first) {
    float sum_s = 0.0, opacity = 0.0, occlusion = 0.0, sum_k = 0.0;
    for (int i = 0; i < 3; i++) {
        vec2 uv = p[i].xy + s * d[i].xy + 0.5;
        vec4 t = textureLod(views, vec3(uv, layers[i]), mip);
        float z = (farthest ? t.g : t.r) * (2.0 * SQRT2) - SQRT2 * t.a;
        float k = weights[i];
        if (!first) {
            // a e / (1 + e) with e = x2 / (a AGREEMENT)^2 and x = z - a depth(q), without dividing by a.
            float x = (z - t.a * (p[i].z + s * d[i].z)) * (1.0 / AGREEMENT);
            k *= 1.0 - t.a * x * x / max(x * x + t.a * t.a, 1e-12);
        }
        sum_k += k;
        sum_s += k * (z - t.a * p[i].z) / d[i].z;
        opacity += k * t.a;
        occlusion += k * t.b;
    }
    float inverse = opacity > 0.0 ? 1.0 / opacity : 0.0;
    return Surface(sum_s * inverse, opacity / max(sum_k, 1e-6), min(occlusion * inverse, 1.0));
}

// Three 10-bit layers, as floats for the sampler.
vec3 unpack_layers(uint packed, uint first) {
    return vec3(uvec3(packed, packed >> 10u, packed >> 20u) & 0x3ffu) + float(first);
}
