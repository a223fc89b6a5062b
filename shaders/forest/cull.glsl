// The decision of the cull. `precise` and a fixed order of operations let src/forest/cull.rs agree to the bit.
// Needs physics/hash.glsl and physics/handover.glsl.

#include "land/silhouette.glsl"

const uint CLASS_CAMERA = 1u << 5u;   // low five bits: distance bin

// Centre of a tree's box from the camera, m.
vec3 tree_centre(View v, SeedQuad q, Seed s, Species kind) {
    precise vec2 xy = (q.corner + s.position) - v.quad_offset;
    precise float z = (s.ground - v.camera_height) + kind.centre * s.scale;
    return vec3(xy, z);
}

float precise_dot(vec3 a, vec3 b) {
    precise float d = a.x * b.x;
    d = d + a.y * b.y;
    d = d + a.z * b.z;
    return d;
}

// From the base to the top of the box, m.
float tree_height(Species kind, float scale) {
    precise float height = (2.0 * kind.scale_to_metres.z) * scale;
    return height;
}

// 0 if the camera does not see it.
uint classify(View v, SeedQuad q, Seed s, Species kind, vec3 centre, sampler2DArray heights) {
    precise float radius = kind.bounding_radius * s.scale;
    precise float d2 = precise_dot(centre, centre);
    // Where this tree has faded out (tree_fade): among others, and on a silhouette.
    precise float end = kind.range * fade_end(unit(hash(s.identity ^ HASH_FADE)));
    precise float last = end * v.silhouette_ratio;
    if (d2 >= last * last) return 0u;
    bool beyond = d2 >= end * end;
    bool inside = true;
    for (int k = 0; k < 6; k++) {
        precise float d = precise_dot(v.planes[k].xyz, centre) + v.planes[k].w;
        inside = inside && d >= -radius;
    }
    if (silhouette(v, q, s, centre, tree_height(kind, s.scale), heights, inside && beyond) > 0.0 || (inside && !beyond)) {
        uint bin = 0u;
        for (uint k = 0u; k < DISTANCE_BINS - 1u; k++) bin += d2 > v.bins[k >> 2u][k & 3u] ? 1u : 0u;
        return CLASS_CAMERA | bin;
    }
    return 0u;
}
