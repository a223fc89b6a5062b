// What harmonics leave out of the sun on surfaces that are seen (src/bake/harmonics/seen.rs). Needs physics/{correction,light}.glsl.

layout(std140, binding = 12) uniform Optics { vec4 items[OPTICS * MAX_SPECIES]; } optics; // of each species: see OPTICS

// Of a form of a tree, for the side of leaves that is seen, their other side, and bark, at a height in scaled tree space; viewer and sun in the tree's axes.
vec3 seen_sun(uint row, uint form, vec3 viewer, vec3 sun, float height) {
    CorrectionTerms y = phase_terms(viewer.z, sun.z, angle_between(viewer, sun));
    vec3 over = vec3(0.0);
    for (uint part = 0u; part < 3u; part++) {
        uint k = OPTICS * row + 3u + 12u * form + 4u * part;
        vec4 coefficients[4] = vec4[](optics.items[k], optics.items[k + 1u], optics.items[k + 2u], optics.items[k + 3u]);
        over[part] = correction_at(correction_line(coefficients, y, 1.0), height);
    }
    return over;
}
