// Colours of the ground in the view modes. Needs frame/ground.glsl and frame/view_mode.glsl.

vec3 ground_mode(GroundPoint at, GroundLight g, vec3 n) {
    float distance = length(at.position);
    vec3 shown = 0.5 + 0.5 * n;
    if (VIEW_MODE == MODE_FRACTIONS) shown = fractions_colour(g.fractions);
    if (VIEW_MODE == MODE_COVERAGE) shown = mix(vec3(0.3, 0.2, 0.1), vec3(0.1, 0.6, 0.15), g.coverage);
    if (VIEW_MODE == MODE_LOD) {
        // A hue a power of two of texel size; grey where discs are not told apart; dark where trees stand for themselves.
        Cover c = cover(at.cover);
        float size = log2(c.texel);
        shown = mix(vec3(0.5), hue_colour(size / 6.0), c.resolved) * (0.3 + 0.7 * at.paths.x / max(at.paths.y, 1e-9));
    }
    if (VIEW_MODE == MODE_CASCADES) {
        shown = cascade_colour(cascade_at(view.v.cascade_far, view.v.cascade_count, distance),
                               shadow_maps(at.position, n, max(dot(n, view.v.sun_direction), 0.0), distance));
    }
    return shown;
}
