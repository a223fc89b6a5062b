// Which species of a mix are seen, and how much stands above what is seen of them. Twin: src/physics/strata.rs, where the forms are
// derived. Needs interface.glsl.

// Crowns of a species: heights between which they are, m, and optical paths through all of them: the view's, the sun's beyond that, the
// sky's.
struct Layer {
    float low, high;
    vec3 paths;
};

// What is seen of a species: its share of what is seen of trees, and what the sun's light and the sky's pass above that, on average.
struct Stratum {
    float share;
    vec2 above;
};

// Share of a layer that is above what is seen of it, on average, where the optical path through it is `path`.
float above_one_layer(float path) {
    // The closed form cancels where paths are short.
    if (path < 0.05) return 0.5 - path / 12.0;
    return 1.0 / path - 1.0 / (exp(min(path, 80.0)) - 1.0);
}

// Integrals of exp(-c s) and s exp(-c s) from 0 to `height`.
vec2 layer_moments(float rate, float height) {
    float path = rate * height;
    if (path < 0.05) return vec2(height * (1.0 - path * (0.5 - path / 6.0)), height * height * (0.5 - path * (1.0 / 3.0 - path / 8.0)));
    float left = exp(-path);
    return vec2((1.0 - left) / rate, (1.0 - left * (1.0 + path)) / (rate * rate));
}

vec3 layer_rates(Layer l, float top) { return l.low < top && l.high >= top ? l.paths / (l.high - l.low) : vec3(0.0); }

// What is seen of each of the layers.
void strata(Layer layers[MAX_SPECIES], uint count, out Stratum seen[MAX_SPECIES]) {
    const float NONE = -1e30;
    float top = NONE, all = 0.0;
    for (uint k = 0u; k < count; k++) {
        top = max(top, layers[k].high);
        seen[k] = Stratum(0.0, vec2(0.0));
    }
    vec3 passed = vec3(0.0); // from above down to `top`
    for (uint step = 0u; step < 2u * count; step++) {
        float bottom = NONE;
        vec3 rate = vec3(0.0);
        for (uint k = 0u; k < count; k++) {
            Layer l = layers[k];
            bottom = max(bottom, max(l.low < top ? l.low : NONE, l.high < top ? l.high : NONE));
            rate += layer_rates(l, top);
        }
        if (bottom == NONE) break;
        float height = top - bottom;
        vec2 m = exp(-passed.x) * layer_moments(rate.x, height);
        for (uint k = 0u; k < count; k++) {
            float here = layer_rates(layers[k], top).x;
            seen[k].share += here * m.x;
            seen[k].above += here * (passed.yz * m.x + rate.yz * m.y);
        }
        passed += rate * height;
        top = bottom;
    }
    for (uint k = 0u; k < count; k++) all += seen[k].share;
    for (uint k = 0u; k < count; k++) {
        seen[k].above /= max(seen[k].share, 1e-30);
        seen[k].share /= max(all, 1e-30);
    }
}
