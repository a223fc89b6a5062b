// z-fields: surfaces along a ray from three depth views (BN12, section 5). Twin: src/physics/zfield.rs.
//
// All is in scaled tree space, where the tree fits the cylinder r <= 1, |z| <= 1. A ray is p + s d. A view i maps a
// point to m_i = (u - 1/2, v - 1/2, depth), linearly, so that m_i(p + s d) = m_i(p) + s m_i(d): callers pass these two.
// Texels are (nearest depth, farthest depth, occlusion) times opacity, opacity; depths stored as (d + sqrt 2) / (2 sqrt 2).

// The texel of a view that holds a point; of points outside the view the nearest.
vec4 view_texel(sampler2DArray views, vec2 at, float layer, int level) {
    // Not textureSize(views, level): llvmpipe takes one invocation's level for all.
    ivec2 last = max(textureSize(views, 0).xy >> level, 1) - 1;
    return texelFetch(views, ivec3(clamp(ivec2(floor(at * vec2(last + 1))), ivec2(0), last), int(layer)), level);
}

// How a view is sampled between its texels.
#ifndef VIEW_SAMPLE
#define VIEW_SAMPLE(views, at, layer, mip) textureLod(views, vec3(at, layer), mip)
#endif

const float SQRT2 = 1.4142135623730951;

struct Surface {
    float s;          // along the ray; where nothing is, the last estimate
    float opacity;
    float occlusion;  // sky visibility in the isolated tree
    vec3 shares;      // of the opacity, by view
};

// Depth by which a view may disagree with the point found so far before it counts half.
const float AGREEMENT = 0.2;

// How far an estimate moves the point: all the way to a surface of a twenty-fourth of opacity, continuously less for less. A
// faint texel must not decide where to look, or silhouettes follow the borders of texels.
float zfield_move(float s, float estimate, float opacity) { return mix(s, estimate, min(24.0 * opacity, 1.0)); }

// A first estimate of s: one unfiltered texel from each view at p + s d, outside the view its border. Each view's surface
// is at s_i = (z_i - depth_i(p)) / depth_i(d); their mean is weighted by opacity, which premultiplied texels give without
// a division each. inverse_depth is 1 / depth_i(d). Where little or nothing is, s stays: see zfield_move.
float zfield_estimate(sampler2DArray views, vec3 p[3], vec3 d[3], vec3 inverse_depth, vec3 layers, vec3 weights, float mip,
                      float s, bool farthest) {
    float sum_s = 0.0, opacity = 0.0;
    int level = min(int(mip), textureQueryLevels(views) - 1);
    for (int i = 0; i < 3; i++) {
        vec4 t = view_texel(views, p[i].xy + s * d[i].xy + 0.5, layers[i], level);
        float z = (farthest ? t.g : t.r) * (2.0 * SQRT2) - SQRT2 * t.a;
        sum_s += weights[i] * (z - t.a * p[i].z) * inverse_depth[i];
        opacity += weights[i] * t.a;
    }
    return opacity > 0.0 ? zfield_move(s, sum_s / opacity, opacity) : s;
}

// The surface near q = p + s d, filtered. With `refine`, when q is more than the start of the search, a view whose surface
// lies far from q shows another branch, and loses weight: k_i = w_i (1 - a_i e_i / (1 + e_i)) with
// e_i = ((z_i - depth_i(q)) / AGREEMENT)^2.
Surface zfield_fetch(sampler2DArray views, vec3 p[3], vec3 d[3], vec3 inverse_depth, vec3 layers, vec3 weights, float mip,
                     float s, bool farthest, bool refine) {
    float sum_s = 0.0, opacity = 0.0, occlusion = 0.0, sum_k = 0.0;
    vec3 shares;
    for (int i = 0; i < 3; i++) {
        vec2 uv = p[i].xy + s * d[i].xy + 0.5;
        vec4 t = VIEW_SAMPLE(views, uv, layers[i], mip);
        float z = (farthest ? t.g : t.r) * (2.0 * SQRT2) - SQRT2 * t.a;
        // a e / (1 + e) with e = x2 / (a AGREEMENT)^2 and x = z - a depth(q), without dividing by a.
        float x = (z - t.a * (p[i].z + s * d[i].z)) * (1.0 / AGREEMENT);
        float other = refine ? t.a * x * x / max(x * x + t.a * t.a, 1e-12) : 0.0;
        float k = weights[i] * (1.0 - other);
        sum_k += k;
        sum_s += k * (z - t.a * p[i].z) * inverse_depth[i];
        shares[i] = k * t.a;
        opacity += shares[i];
        occlusion += k * t.b;
    }
    float inverse = opacity > 0.0 ? 1.0 / opacity : 0.0;
    return Surface(opacity > 0.0 ? sum_s * inverse : s, opacity / max(sum_k, 1e-6), min(occlusion * inverse, 1.0), shares);
}

// The surface on a ray: `estimates` unfiltered and `filtered` filtered iterations that only move the point, then one that
// gives depth, opacity and occlusion. The former read one mip coarser, so that a small hole before the start does not end
// the search.
Surface zfield_search(sampler2DArray views, vec3 p[3], vec3 d[3], vec3 layers, vec3 weights, float mip, uint estimates,
                      uint filtered, bool farthest) {
    vec3 inverse_depth = 1.0 / vec3(d[0].z, d[1].z, d[2].z);
    float s = 0.0;
    for (uint k = 0u; k < estimates; k++) {
        s = zfield_estimate(views, p, d, inverse_depth, layers, weights, mip + 1.0, s, farthest);
    }
    for (uint k = 0u; k < filtered; k++) {
        Surface at = zfield_fetch(views, p, d, inverse_depth, layers, weights, mip + 1.0, s, farthest, k > 0u);
        s = zfield_move(s, at.s, at.opacity);
    }
    return zfield_fetch(views, p, d, inverse_depth, layers, weights, mip, s, farthest, estimates + filtered > 0u);
}
