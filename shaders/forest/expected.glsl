// Coverage to expect from the local densities, without knowing any tree.

// Optical thickness of the crowns from above: sum of density times mean area. Channels as in a coverage tile: the
// first is the coverage, then one a species, 0 beyond.
float total_thickness(vec4 channels[COVER_GROUPS]) {
    float sum = -channels[0].x;
    for (uint g = 0u; g < COVER_GROUPS; g++) sum += dot(channels[g], vec4(1.0));
    // Filtering rounds.
    return max(sum, 0.0);
}

// Discs overlap: at random they cover 1 - exp(-Lambda A), not Lambda A (BN12, section 4).
float expected_coverage(vec4 channels[COVER_GROUPS]) { return 1.0 - exp(-total_thickness(channels)); }
