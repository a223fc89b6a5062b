// Shadow maps: depth towards the sun, 1 nearest. Twin: src/physics/shadow.rs.

// Change of depth, in widths of the cascade, along its axes x and y (in [-1, 1]) on a plane with the normal n; at most that of a
// plane 76 degrees from facing the sun.
vec2 plane_gradient(vec3 n, vec3 x, vec3 y, vec3 sun) {
    return clamp(vec2(dot(n, x), dot(n, y)) * (-0.5 / max(dot(n, sun), 1e-3)), -2.0, 2.0);
}

// The cascade for a distance, given how far each of `count` is used: MAX_CASCADES beyond the last, and without any.
// The loop's end is no uniform: lavapipe 22.3.6 unrolls a loop that ends at one, and so compiles the shader anew in every frame.
uint cascade_at(vec4 far, uint count, float distance) {
    uint nearer = 0u;
    for (uint k = 0u; k < MAX_CASCADES; k++) nearer += k < count && distance > far[k] ? 1u : 0u;
    return nearer < count ? nearer : MAX_CASCADES;
}

// The matrix of one of the cascades, and the texel of the shadow map where its first one is. By choice, because not all drivers index as well.
mat4 cascade_matrix(View v, uint cascade, out vec2 turn) {
    mat4 shadow = v.cascade_from_world[0];
    turn = v.cascade_turn[0].xy;
    for (uint k = 1u; k < MAX_CASCADES; k++) {
        if (k == cascade) shadow = v.cascade_from_world[k];
        if (k == cascade) turn = v.cascade_turn[k].xy;
    }
    return shadow;
}

// Trees write their depth with a name of 8 bits in place of its last ones, so that what is on a tree knows the tree itself from others.
float named_depth(float depth, uint name) { return uintBitsToFloat((floatBitsToUint(depth) & ~255u) | (name & 255u)); }

// What is looked for in the map is on the ground.
const uint NO_TREE = 256u;
// What is looked for in the map is on a mesh that is in it, single leaves and all.
const uint ON_MESH = 257u;

// Which of four casters leave the sun to points at the depths: those farther from it, and the tree that they are on, whose own shadow
// is known otherwise. No tree is deeper than `reach`; what is farther before it and has its name has it by chance.
vec4 caster_visibility(vec4 casters, vec4 depths, uint own, float reach) {
    // A name moves a depth by up to 2^-16, half a texel of a map of 2048 and two of 8192: leaves would shade themselves, and by their tree's
    // name. Without its bits a depth is at most as near as it was drawn.
    casters = own == ON_MESH ? uintBitsToFloat(floatBitsToUint(casters) & ~255u) : casters;
    bvec4 farther = lessThanEqual(casters, depths);
    bvec4 same = equal(floatBitsToUint(casters) & 255u, uvec4(own)), near = lessThan(casters, depths + reach);
    return vec4(farther.x || (same.x && near.x), farther.y || (same.y && near.y), farther.z || (same.z && near.z),
                farther.w || (same.w && near.w));
}

// Bilinear blend over the four texels around a position in [-1, 1]^2; lit outside, and behind the far side, where casters' depths
// are cut off at 0, by what is before it. Casters are drawn at the texels' centres:
// the ground goes on to there with its gradient, so its depth to compare with is the plane's there. Crowns are round: 0.
// The map repeats: `turn` is its texel where the cascade's first one is.
float sun_visibility(sampler2DArray map, vec3 at, vec2 gradient, vec2 turn, uint cascade, uint own, float reach) {
    float side = float(textureSize(map, 0).x);
    vec2 t = (at.xy * 0.5 + 0.5) * side - 0.5;
    vec2 cell = floor(t), f = t - cell;
    vec2 step = gradient * (2.0 / (SHADOW_DEPTHS * side));
    vec4 depths = max(at.z + step.x * (vec4(0.0, 1.0, 1.0, 0.0) - f.x) + step.y * (vec4(1.0, 1.0, 0.0, 0.0) - f.y), 0.0);
    // Gathered at the corner that the four texels share, so that they are the ones that f weighs.
    vec4 lit = caster_visibility(textureGather(map, vec3((cell + turn + 1.0) / side, float(cascade))), depths, own, reach);
    vec2 along = mix(lit.wx, lit.zy, f.x);
    return all(lessThan(abs(at.xy), vec2(1.0))) ? mix(along.x, along.y, f.y) : 1.0;
}
