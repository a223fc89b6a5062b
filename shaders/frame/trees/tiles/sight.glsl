// What finding a tree's visible samples takes, in SIGHT_TEXELS words of 16 bytes: written once a tree, read once a pixel of it.
//
// A ray through a pixel meets the plane through the tree's centre across the view (the one that the graphics pipeline draws its
// quad on) at a right + b up. With d the pixel's offset from a reference pixel, where a point of the plane lies that is before the
// camera (the tree's centre, if it is), both and the depth are projective in d, over one factor h = 1 / (1 + tilt . d):
//
//     a = (start.x + across.xy . d) h      b = (start.y + across.zw . d) h      depth = depth h
//
// In each of the three views around the direction, what right, up and the unit vector w to the eye become is kept; the eye is at
// w / closeness.

struct Sight {
    vec2 pixel;      // the reference pixel
    vec2 tilt;
    vec4 across;
    vec4 extent;     // of the quad: least and greatest a, least and greatest b
    vec2 start;
    float depth;     // along the camera's axis, of the plane at the reference pixel, m
    vec2 weights;    // of the first two views
    uint layers;     // of the views, from the species' first: 10 bits each; bit 31: seen from below
    uint first;      // layer of the species' first view
    uint mip;
    uint draw;       // which of the camera's draws it belongs to: magnified, with estimates, without, converged
    uint bin;        // of depth
    float fade;      // factor of the opacity
    uint mesh;       // samples in which it is its mesh
    vec3 right[3];   // in the views
    vec3 up[3];
    vec3 toward[3];
    float closeness; // 1 / distance of the eye in tree space
    float dither;
    uvec2 row;       // of the mask table, without its first and last column
};

uvec4 sight_words(Sight s, uint k) {
    if (k == 0u) return floatBitsToUint(vec4(s.pixel, s.tilt));
    if (k == 1u) return floatBitsToUint(s.across);
    if (k == 2u) return uvec4(packHalf2x16(s.extent.xy), packHalf2x16(s.extent.zw), packHalf2x16(s.start), floatBitsToUint(s.depth));
    if (k == 3u) {
        uint kind = s.first | s.mip << 16u | s.draw << 20u | uint(s.dither * 1024.0) << 22u;
        return uvec4(packHalf2x16(s.weights), s.layers, kind, packHalf2x16(vec2(s.fade, 0.0)) | s.bin << 16u | s.mesh << 26u);
    }
    if (k < 7u) {
        vec3 r = s.right[k - 4u], u = s.up[k - 4u], w = s.toward[k - 4u];
        return uvec4(packHalf2x16(r.xy), packHalf2x16(u.xy), packHalf2x16(vec2(r.z, u.z)), packHalf2x16(w.xy));
    }
    return uvec4(packHalf2x16(vec2(s.toward[0].z, s.toward[1].z)), packHalf2x16(vec2(s.toward[2].z, s.closeness)), s.row);
}

// Its bin of depth alone.
uint sight_bin(usamplerBuffer records, uint tree) { return texelFetch(records, int(tree * SIGHT_TEXELS) + 3).w >> 16u & 0x3ffu; }

Sight unpack_sight(usamplerBuffer records, uint tree) {
    int at = int(tree * SIGHT_TEXELS);
    Sight s;
    vec4 t = uintBitsToFloat(texelFetch(records, at));
    s.pixel = t.xy;
    s.tilt = t.zw;
    s.across = uintBitsToFloat(texelFetch(records, at + 1));
    uvec4 w = texelFetch(records, at + 2);
    s.extent = vec4(unpackHalf2x16(w.x), unpackHalf2x16(w.y));
    s.start = unpackHalf2x16(w.z);
    s.depth = uintBitsToFloat(w.w);
    w = texelFetch(records, at + 3);
    s.weights = unpackHalf2x16(w.x);
    s.layers = w.y;
    s.first = w.z & 0xffffu;
    s.mip = w.z >> 16u & 15u;
    s.draw = w.z >> 20u & 3u;
    s.dither = (float(w.z >> 22u) + 0.5) * (1.0 / 1024.0);
    s.fade = unpackHalf2x16(w.w).x;
    s.bin = w.w >> 16u & 0x3ffu;
    s.mesh = w.w >> 26u;
    for (int k = 0; k < 3; k++) {
        w = texelFetch(records, at + 4 + k);
        vec2 z = unpackHalf2x16(w.z);
        s.right[k] = vec3(unpackHalf2x16(w.x), z.x);
        s.up[k] = vec3(unpackHalf2x16(w.y), z.y);
        s.toward[k] = vec3(unpackHalf2x16(w.w), 0.0);
    }
    w = texelFetch(records, at + 7);
    vec2 z = unpackHalf2x16(w.x), last = unpackHalf2x16(w.y);
    s.toward[0].z = z.x;
    s.toward[1].z = z.y;
    s.toward[2].z = last.x;
    s.closeness = last.y;
    s.row = w.zw;
    return s;
}

// Column k of a row of the mask table that lacks its first column, which is empty, and its last, which is full.
uint inner_column(uvec2 row, uint k, uint samples) {
    uint full = (1u << samples) - 1u;
    if (k == 0u || k == samples) return k == 0u ? 0u : full;
    uint bit = (k - 1u) * samples;
    return (bit < 32u ? row.x >> bit : row.y >> (bit - 32u)) & full;
}
