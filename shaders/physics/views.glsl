// Direction to three z-field views and weights. Twin: src/physics/views.rs, where the layout is derived.

const float HALF_PI = 1.5707963267948966;

// Layer of the view at integer coordinates (i, j), |i| + |j| <= n: rows i from -n to n, each with 2(n - |i|) + 1 views.
uint view_layer(int i, int j, int n) {
    int row = i <= 0 ? (i + n) * (i + n) : n * n + i * (2 * n + 1) - i * (i - 1);
    return uint(row + j + n - abs(i));
}

// The three views around a direction of the upper hemisphere (any length), and their weights, which sum to one and
// vary continuously. PAPERS: zenith 90 deg * max(|x|, |y|), azimuth atan2(y, x), x = (i + j) / n, y = (j - i) / n.
void view_lookup(vec3 w, int n, out uvec3 layers, out vec3 weights) {
    float radial = length(w.xy);
    float m = atan(radial, max(w.z, 0.0)) / HALF_PI;
    // Concentric squares: the azimuth's ray meets the square of half side m. At the zenith m is 0 and any azimuth does.
    float side = max(abs(w.x), abs(w.y));
    vec2 xy = side > 0.0 ? w.xy * (m / side) : vec2(0.0);
    vec2 ij = 0.5 * float(n) * vec2(xy.x - xy.y, xy.x + xy.y);
    vec2 a = abs(ij);
    // Rounding may put the horizon a hair outside |i| + |j| = n.
    a = min(a, vec2(float(n)));
    vec2 cell = floor(a);
    vec2 f = a - cell;
    ivec2 c = ivec2(cell);
    ivec2 s = ivec2(ij.x < 0.0 ? -1 : 1, ij.y < 0.0 ? -1 : 1);
    bool lower = f.x + f.y <= 1.0;
    ivec2 c0 = lower ? c : c + 1;
    ivec2 c1 = lower ? c + ivec2(1, 0) : c + ivec2(0, 1);
    ivec2 c2 = lower ? c + ivec2(0, 1) : c + ivec2(1, 0);
    // 1 - f.x - f.y rounds twice and may end below 0 where f.x + f.y rounds to 1.
    weights = max(lower ? vec3(1.0 - f.x - f.y, f.x, f.y) : vec3(f.x + f.y - 1.0, 1.0 - f.x, 1.0 - f.y), vec3(0.0));
    // Vertices outside the diamond have no weight but for rounding: any layer near serves.
    ivec3 ai = ivec3(c0.x, c1.x, c2.x), aj = ivec3(c0.y, c1.y, c2.y);
    for (int k = 0; k < 3; k++) {
        if (ai[k] + aj[k] > n) {
            if (ai[k] > aj[k]) ai[k] = n - aj[k]; else aj[k] = n - ai[k];
        }
        layers[k] = view_layer(s.x * ai[k], s.y * aj[k], n);
    }
}
