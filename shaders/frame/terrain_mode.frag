// The ground in a view mode.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "frame/terrain_point.glsl"
#include "frame/view_mode.glsl"

layout(location = 0) out vec4 colour;

void main() {
    GroundPoint at = ground_point();
    GroundLight g = ground_light(at, ground_normal(at.slope_at, at.layer));
    vec3 n = ground_normal(at.slope_at, at.layer);
    float distance = length(position);
    vec3 shown = 0.5 + 0.5 * n;
    if (VIEW_MODE == MODE_FRACTIONS) shown = fractions_colour(g.fractions);
    if (VIEW_MODE == MODE_COVERAGE) shown = mix(vec3(0.3, 0.2, 0.1), vec3(0.1, 0.6, 0.15), g.coverage);
    if (VIEW_MODE == MODE_LOD) {
        // A hue a power of two of texel size; grey where discs are not told apart; dark where trees stand for themselves.
        Cover c = cover(at.cover);
        float size = log2(c.texel);
        shown = mix(vec3(0.5), hue_colour(size / 6.0), c.resolved) * (0.3 + 0.7 * paths.x / max(paths.y, 1e-9));
    }
    if (VIEW_MODE == MODE_CASCADES) {
        shown = cascade_colour(cascade_at(view.v.cascade_far, view.v.cascade_count, distance),
                               shadow_maps(position, n, max(dot(n, view.v.sun_direction), 0.0), distance));
    }
    colour = vec4(shown, 1.0);
}
