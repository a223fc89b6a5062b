// How much of a tree's mesh is drawn at its apparent size (Cook et al. 2007). Twin: src/physics/levels.rs, where the forms are derived.
// Needs interface.glsl.

// Share of the leaves that is drawn of a tree whose cards have a side of so many pixels, from a least side on.
float leaf_share(float pixels, float least) {
    float ratio = pixels / max(least, 1e-6);
    return pixels >= least ? 1.0 : max(ratio * ratio, LEAST_SHARE);
}

// Rank from which on cards are not drawn.
float drawn_end(float share) { return share + FADE_BAND * share * (1.0 - share); }

// Factor of the size of a card of a rank along each side.
float card_scale(float rank, float share) {
    float weight = clamp((drawn_end(share) - rank) / max(2.0 * FADE_BAND * share * (1.0 - share), 1e-6), 0.0, 1.0);
    return share < 1.0 ? sqrt(weight / share) : 1.0;
}
