// Colours of the view modes: pictures of what the renderer decides, not of light.

layout(constant_id = 12) const uint VIEW_MODE = 0u;
const uint MODE_FRACTIONS = 1u; // lit ground, shadowed ground, lit trees, shadowed trees
const uint MODE_COVERAGE = 2u;  // coverage of the ground by discs of trees, from above
const uint MODE_LOD = 3u;       // what represents a tree, and the level of the coverage
const uint MODE_CASCADES = 4u;  // shadow cascades
const uint MODE_NORMALS = 5u;   // east, north, up: 0 to 1 for -1 to 1

vec3 fractions_colour(vec4 k) {
    return k.x * vec3(0.9, 0.6, 0.2) + k.y * vec3(0.2, 0.1, 0.03) + k.z * vec3(0.25, 0.8, 0.15) + k.w * vec3(0.02, 0.12, 0.05);
}

// Evenly spread hues: red, yellow, green, blue, magenta, and again.
vec3 hue_colour(float t) { return clamp(abs(fract(t + vec3(0.0, 2.0, 1.0) / 3.0) * 6.0 - 3.0) - 1.0, 0.0, 1.0); }

vec3 cascade_colour(uint c, float lit) {
    return c >= MAX_CASCADES ? vec3(0.3) : hue_colour(float(c) * 0.25) * (0.25 + 0.75 * lit);
}
