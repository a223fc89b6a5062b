// The quad of one tree: the plane through its centre across the view that it lies on, and where that is on the screen. Needs frame/camera.glsl and frame/trees/zfield_space.glsl.

struct TreePlane {
    vec3 half_extent;  // m
    vec2 turn;         // cosine and sine
    uint sway;         // in the word of the tree's species
    vec3 w;            // unit vector to the eye, in tree space; across it lies the plane
    float far;         // distance of the eye, in tree space
    vec3 right, up;    // unit vectors of the plane
    vec4 extent;       // of the quad: least and greatest along right, then up
};

TreePlane tree_plane(Tree t, Species kind) {
    TreePlane p;
    p.half_extent = kind.scale_to_metres * t.scale;
    p.turn = t.turn;
    p.sway = t.species;
    vec3 c = resting(t, -t.centre) / p.half_extent;
    p.far = max(length(c), 1e-6);
    p.w = c / p.far;
    frame_across(p.w, p.right, p.up);
    p.extent = vec4(0.0);
    return p;
}

// A direction of the world in tree space.
vec3 to_tree(TreePlane p, vec3 d) {
    return unswayed(p.sway, vec3(p.turn.x * d.x + p.turn.y * d.y, p.turn.x * d.y - p.turn.y * d.x, d.z)) / p.half_extent;
}

// Extents of the quad. From afar they are the tree's; near, points before the plane look larger by far / (far - depth), and
// depth is at most that of the cylinder. Half a texel of the mip in use on each side, so that bilinear edges are not cut.
vec4 quad_extent(TreePlane p, float mip, vec4 a, vec4 b, vec4 c, bool below, int rings, float resolution) {
    float support = length(p.w.xy) + abs(p.w.z);
    vec4 extent = tree_bounds(a, b, c, p.w, below, rings);
    extent *= p.far / max(p.far - support, 0.1 * p.far);
    vec2 margin = exp2(mip) / resolution * vec2(1.0, support);
    return extent + vec4(-margin.x, margin.x, -margin.y, margin.y);
}

// Pixels that the quad may cover samples of: first column and row, and those behind the last.
uvec4 screen_box(Tree t, Species kind, TreePlane p, Camera camera, uvec2 size) {
    vec2 low = vec2(1e30), high = vec2(-1e30);
    bool behind = false;
    for (uint c = 0u; c < 4u; c++) {
        vec3 corner = p.right * ((c & 1u) == 0u ? p.extent.x : p.extent.y) + p.up * ((c & 2u) == 0u ? p.extent.z : p.extent.w);
        vec3 at = world_from_tree(t, kind, corner);
        float depth = dot(camera.forward, at);
        // What reaches behind the eye may be anywhere.
        behind = behind || depth < 1e-3;
        vec2 pixel = vec2(dot(at, camera.x), dot(at, camera.y)) / max(depth, 1e-3);
        low = min(low, pixel);
        high = max(high, pixel);
    }
    vec2 extent = vec2(size);
    // A sample lies up to half a pixel from its pixel's centre; 1/64 pixel for rounding.
    low = behind ? vec2(0.0) : clamp(floor(low + 0.5 * extent - 1.0 / 64.0), vec2(0.0), extent);
    high = behind ? extent : clamp(ceil(high + 0.5 * extent + 1.0 / 64.0), vec2(0.0), extent);
    return uvec4(uvec2(low), uvec2(high));
}
