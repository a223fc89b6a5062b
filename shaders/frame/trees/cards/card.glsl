// Cards of a tree's cloud (Behrendt et al. 2005, section 2). Needs interface.glsl.

// A card, of four texels.
Card fetch_card(usamplerBuffer cards, uint index) {
    int at = int(index) * 4;
    uvec4 a = texelFetch(cards, at), b = texelFetch(cards, at + 1), c = texelFetch(cards, at + 2), d = texelFetch(cards, at + 3);
    return Card(uintBitsToFloat(a.xyz), uintBitsToFloat(a.w), uintBitsToFloat(b.xyz), b.w, uintBitsToFloat(c.xyz), c.w, d.x);
}

// Unit vector out of its front.
vec3 card_normal(Card c) { return normalize(cross(c.right, c.up)); }

// Whether an eye is behind it; the eye's place is in the model's axes and metres, as the card's is.
bool seen_from_behind(Card c, vec3 eye) { return dot(cross(c.right, c.up), eye - c.centre) < 0.0; }

// The texel of a place on it, in [-1, 1] from its middle to its right and upper edges, in the atlas; both sides' pictures have the same
// sides up and right.
vec2 card_texel(Card c, vec2 at, bool behind) {
    uint origin = behind ? c.back : c.front;
    vec2 size = vec2(c.size & 0xffffu, c.size >> 16u);
    return vec2(origin & 0xffffu, origin >> 16u) + (0.5 + vec2(0.5, -0.5) * at) * size;
}

// What of the distance between the full cloud and the far form lies behind a tree of an apparent height: 0 from `begin` pixels on, 1 at half of them.
float between_forms(float pixels, float begin) { return clamp(begin / max(pixels, 1e-6) - 1.0, 0.0, 1.0); }

// The threshold that opacity times the Gaussian must reach, linear by pieces in the distance: first the far form grows out of the middles of its
// cards, then the full cloud vanishes into those of its own, so that neither leaves a gap for the other.
float fade_threshold(float between, bool far_form) {
    return far_form ? clamp(1.0 - 2.0 * between, 0.0, 1.0) : clamp(2.0 * between - 1.0, 0.0, 1.0);
}

// The Gaussian by which the opacity of a card is less away from its middle.
float card_gauss(vec2 at) { return exp(-2.0 * dot(at, at)); }
