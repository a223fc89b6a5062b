// From the world to the scaled space of one tree, where its z-field lives. Needs forest/wind.glsl.

// A tree's record, of eight texels.
Tree fetch_tree(usamplerBuffer trees, uint index) {
    Tree t;
    int at = int(index) * 8;
    uvec4 a = texelFetch(trees, at), b = texelFetch(trees, at + 1), c = texelFetch(trees, at + 2), d = texelFetch(trees, at + 3);
    t.centre = uintBitsToFloat(a.xyz);
    t.scale = uintBitsToFloat(a.w);
    t.turn = uintBitsToFloat(b.xy);
    t.species = b.z;
    t.identity = b.w;
    t.view_layers = c.x;
    t.light_layers = c.y;
    t.view_weights = uintBitsToFloat(c.zw);
    t.light_weights = uintBitsToFloat(d.xy);
    t.mip = uintBitsToFloat(d.z);
    t.fade = uintBitsToFloat(d.w);
    a = texelFetch(trees, at + 4);
    b = texelFetch(trees, at + 5);
    c = texelFetch(trees, at + 6);
    d = texelFetch(trees, at + 7);
    t.sun = uintBitsToFloat(a.xyz);
    t.hole_change = a.w;
    t.sky = uintBitsToFloat(b.xyz);
    t.cascade_tint = b.w;
    t.mean_sun = uintBitsToFloat(c.xyz);
    t.own_lit = c.w;
    t.mean_sky = uintBitsToFloat(d.xyz);
    t.mean_lit_change = d.w;
    return t;
}

// What the forest hands to it, of two texels.
HandedLight fetch_handed(usamplerBuffer handed, uint index) {
    uvec4 a = texelFetch(handed, 2 * int(index)), b = texelFetch(handed, 2 * int(index) + 1);
    return HandedLight(a.xy, a.zw, b.xy, b.zw);
}

HandedLight nothing_handed() { return HandedLight(uvec2(0u), uvec2(0u), uvec2(0u), uvec2(0u)); }

// Its cascade for shadow lookups, MAX_CASCADES where it is beyond all.
uint cascade_of(Tree t) { return t.cascade_tint & 0xffu; }

// In how many of a pixel's samples it is its mesh; and in how many its mesh or its cloud of cards. Masks of both begin at the same sample, so the
// cards' are what the second leaves of the first, and the z-field's are the rest.
uint mesh_count(Tree t) { return t.cascade_tint >> 8u & 15u; }
uint near_count(Tree t) { return t.cascade_tint >> 12u & 15u; }

// Factor of its colours.
float tint_of(Tree t) { return unpackHalf2x16(t.cascade_tint).y; }

// A view's projection, of four texels.
ViewBasis fetch_basis(samplerBuffer bases, uint view) {
    int at = int(view) * 4;
    return ViewBasis(texelFetch(bases, at), texelFetch(bases, at + 1), texelFetch(bases, at + 2), texelFetch(bases, at + 3));
}

// Rotation back by a turn's cosine and sine.
mat3 rotation_back(vec2 turn) { return mat3(turn.x, -turn.y, 0.0, turn.y, turn.x, 0.0, 0.0, 0.0, 1.0); }

// A vector turned.
vec3 rotated(vec2 turn, vec3 m) { return vec3(turn.x * m.x - turn.y * m.y, turn.y * m.x + turn.x * m.y, m.z); }

// Rotation back by the tree's turn.
mat3 tree_rotation(Tree t) { return rotation_back(t.turn); }

// A vector of the world in the tree's own axes, as if the tree stood still.
vec3 resting(Tree t, vec3 d) { return unswayed(t.species, tree_rotation(t) * d); }

// A point of scaled tree space in the world, from the camera.
vec3 world_from_tree(Tree t, Species kind, vec3 p) {
    return t.centre + rotated(t.turn, swayed(t.species, p * kind.scale_to_metres * t.scale));
}

// A point or direction in a view: (u - 1/2, v - 1/2, depth).
vec3 project(ViewBasis b, vec3 p) { return vec3(dot(b.u.xyz, p), dot(b.v.xyz, p), dot(b.depth.xyz, p)); }

// Horizontal and upward unit vectors across a direction w.
void frame_across(vec3 w, out vec3 right, out vec3 up) {
    float radial = length(w.xy);
    right = radial > 1e-6 ? vec3(-w.y, w.x, 0.0) / radial : vec3(0.0, 1.0, 0.0);
    up = cross(w, right);
}

// Extents of the tree along right and up around a direction w, seen from afar: (least, greatest) of each. The views
// around w hold the tree's true bounds. A point's coordinate along an axis that turns by 2 a from view to view is a
// cosine of the angle, so between views it exceeds the larger of its two samples by at most 1 / cos a: a is half the
// azimuth between views of the inner ring, and a hundredth more allows for the tilt of the axes against each other. Near
// the zenith, where axes of neighbouring views differ much, the cylinder r <= 1, |z| <= 1 bounds the tree.
vec4 tree_bounds(vec4 a, vec4 b, vec4 c, vec3 w, bool below, int rings) {
    float sine = length(w.xy), cosine = abs(w.z);
    vec4 cylinder = vec4(-1.0, 1.0, -sine - cosine, sine + cosine);
    float ring = floor(atan(sine, cosine) * (float(rings) / 1.5707963));
    if (ring < 2.0) return cylinder;
    vec4 low = min(min(a, b), c), high = max(max(a, b), c);
    vec4 seen = vec4(low.x, high.y, low.z, high.w) * (1.0 / cos(0.78539816 / ring) + 0.01);
    // Seen from behind, left is right.
    if (below) seen.xy = -seen.yx;
    return vec4(max(seen.xz, cylinder.xz), min(seen.yw, cylinder.yw)).xzyw;
}

// Three 10-bit layers, as floats for the sampler.
vec3 unpack_layers(uint packed, uint first) {
    return vec3(uvec3(packed, packed >> 10u, packed >> 20u) & 0x3ffu) + float(first);
}
