// Shadow map texels and their soft lookup. Twin: src/physics/shadow.rs.

// Depth towards the sun (1 nearest) in 24 bits and opacity in 8: one texel, one tree.
uint pack_caster(float depth, float opacity) {
    return uint(clamp(depth, 0.0, 1.0) * 16777215.0) << 8u | uint(clamp(opacity, 0.0, 1.0) * 255.0 + 0.5);
}

// How much of the sun each of four casters leaves to a point at `depth`.
vec4 caster_visibility(uvec4 casters, float depth) {
    vec4 at = vec4(casters >> 8u) * (1.0 / 16777215.0);
    vec4 opacity = vec4(casters & 255u) * (1.0 / 255.0);
    return 1.0 - mix(vec4(0.0), opacity, greaterThan(at, vec4(depth)));
}

// Bilinear blend of the four casters around a position in [-1, 1]^2; lit outside.
float sun_visibility(usampler2DArray map, vec3 at, uint cascade) {
    float side = float(textureSize(map, 0).x);
    vec2 t = (at.xy * 0.5 + 0.5) * side - 0.5;
    vec2 cell = floor(t), f = t - cell;
    // Gathered at the corner that the four texels share, so that they are the ones that f weighs.
    vec4 lit = caster_visibility(textureGather(map, vec3((cell + 1.0) / side, float(cascade))), at.z);
    vec2 along = mix(lit.wx, lit.zy, f.x);
    return all(lessThan(abs(at.xy), vec2(1.0))) ? mix(along.x, along.y, f.y) : 1.0;
}
