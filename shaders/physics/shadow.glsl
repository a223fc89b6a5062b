// Shadow map texels and their soft lookup. Twin: src/physics/shadow.rs.

// Depth towards the sun (1 nearest) in 24 bits and opacity in 8: one texel, one tree.
uint pack_caster(float depth, float opacity) {
    return uint(clamp(depth, 0.0, 1.0) * 16777215.0) << 8u | uint(clamp(opacity, 0.0, 1.0) * 255.0 + 0.5);
}

// How much of the sun a caster leaves to a point at `depth`.
float caster_visibility(uint caster, float depth) {
    float at = float(caster >> 8u) * (1.0 / 16777215.0);
    return at > depth ? 1.0 - float(caster & 255u) * (1.0 / 255.0) : 1.0;
}

// Bilinear blend of the four casters around a position in [-1, 1]^2; lit outside.
float sun_visibility(usampler2DArray map, vec3 at, uint cascade) {
    int side = textureSize(map, 0).x;
    vec2 t = (at.xy * 0.5 + 0.5) * float(side) - 0.5;
    vec2 cell = floor(t), f = t - cell;
    ivec2 c = ivec2(clamp(cell, -2.0, float(side)));
    ivec2 a = clamp(c, ivec2(0), ivec2(side - 1)), b = clamp(c + 1, ivec2(0), ivec2(side - 1));
    int layer = int(cascade);
    float v00 = caster_visibility(texelFetch(map, ivec3(a, layer), 0).r, at.z);
    float v10 = caster_visibility(texelFetch(map, ivec3(b.x, a.y, layer), 0).r, at.z);
    float v01 = caster_visibility(texelFetch(map, ivec3(a.x, b.y, layer), 0).r, at.z);
    float v11 = caster_visibility(texelFetch(map, ivec3(b, layer), 0).r, at.z);
    float lit = mix(mix(v00, v10, f.x), mix(v01, v11, f.x), f.y);
    return all(lessThan(abs(at.xy), vec2(1.0))) ? lit : 1.0;
}
