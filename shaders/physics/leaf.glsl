// Light on a leaf among leaves by its envelope (BBP08, section 4). Twin: src/physics/leaf.rs, where the forms are derived.
//
// An envelope is the optical thickness of the crown around a leaf in LEAF_DIRECTIONS directions, eight half floats a texel. `rule` has two
// vec4s a direction: the direction and its weight, and the integral of unit vectors over what of its cell of the sphere is sky.

struct LeafLight {
    vec2 sky;   // what of an even sky's irradiance arrives on the front, and on the back
    float sun;  // what the crown leaves of the sun
};

// Cosine to the power of the lobe by which directions count for ones between them: 1, 2 and 6 of 8, 14 and 26 directions.
float leaf_lobe(float cosine, int power) {
    float c = max(cosine, 0.0), squared = c * c;
    return power == 1 ? c : power == 2 ? squared : squared * squared * squared;
}

// Adds a direction of an envelope; `others` is what the trees around leave of the sky there.
void leaf_direction(inout LeafLight light, inout vec2 sides, inout float towards, vec4 direction, vec3 sky, float others, float thickness, vec3 n,
                    vec3 sun, int power) {
    float left = exp(-thickness), cosine = dot(n, sky), lobe = direction.w * leaf_lobe(dot(sun, direction.xyz), power);
    vec2 faced = max(vec2(cosine, -cosine), 0.0);
    sides += faced;
    light.sky += faced * (left * others);
    towards += lobe;
    light.sun += lobe * left;
}

// Makes means of the sums; an even sky that nothing hides brings (1 +- n_z) / 2.
LeafLight leaf_means(LeafLight light, vec2 sides, float towards, vec3 n) {
    return LeafLight(light.sky / max(sides, 1e-9) * (0.5 + 0.5 * vec2(n.z, -n.z)), light.sun / max(towards, 1e-9));
}

// Radiance that one side of a leaf sends per irradiance on it (BBP08, eq. 4): the sun's, and of a sky whose irradiance on either side is `sky`.
vec3 leaf_sun(vec3 reflectance, vec3 transmittance, vec3 n, vec3 viewer, vec3 sun) {
    float cosine = dot(n, sun);
    bool same = (cosine >= 0.0) == (dot(n, viewer) >= 0.0);
    return (same ? reflectance : transmittance) * (abs(cosine) / 3.141592653589793);
}

vec3 leaf_sky(vec3 reflectance, vec3 transmittance, vec3 n, vec3 viewer, vec2 sky) {
    vec2 seen = dot(n, viewer) >= 0.0 ? sky : sky.yx;
    return reflectance * seen.x + transmittance * seen.y;
}
