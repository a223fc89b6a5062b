// What a forest leaves of the sky: where its table has a height, over that to which it goes, and a thickness of crowns. Twin:
// src/physics/forest_sky.rs. Needs interface.glsl.

vec2 sky_place(float height, float thickness) {
    vec2 at = vec2(clamp(height, 0.0, 1.0), thickness / (1.0 + thickness));
    return (at * float(SKY_STEPS - 1u) + 0.5) / float(SKY_STEPS);
}
