// The point of the ground that a fragment of the terrain's mesh shows.
#include "frame/ground_point.glsl"
#include "frame/ground.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec2 slope_at;
layout(location = 2) flat in uint layer;
layout(location = 3) in vec3 cover_at;
layout(location = 4) flat in vec2 cover_disc;
layout(location = 5) flat in uint cover_layer;
layout(location = 6) centroid in vec4 tree_sun;
layout(location = 7) centroid in vec4 tree_sky;
layout(location = 8) centroid in vec4 paths;
layout(location = 9) centroid in vec4 vertical;

// In the quad's own tile: beyond its border, as on it.
CoverPoint moved(GroundPoint from, vec2 by, vec3 n) {
    from.cover.at.xy += from.cover.scale * by;
    return from.cover;
}

GroundPoint ground_point() {
    CoverPoint cover = CoverPoint(cover_at, cover_disc.y, cover_disc.x, cover_layer, cover_footprint(dFdx(cover_at.xy), dFdy(cover_at.xy)));
    return GroundPoint(position, slope_at, layer, cover, tree_sun, tree_sky, paths, vertical);
}
