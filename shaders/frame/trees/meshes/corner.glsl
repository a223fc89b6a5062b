// Corners of a model's triangles: the place from the middle of the tree's box, m, and the texture coordinates, 16 bits each. Needs physics/hash.glsl and
// forest/wind.glsl.

const float UV_STEPS = 2048.0; // a texture

vec3 corner_place(uvec4 corner) { return uintBitsToFloat(corner.xyz); }
vec2 corner_uv(uvec4 corner) { return vec2(corner.w & 0xffffu, corner.w >> 16u) * (1.0 / UV_STEPS); }

// Where the wind moves a place of a model to, in its own axes, still from where the middle of the box is moved to: a leaf turns about its own
// middle, and goes with the branch that holds that; all then leans with the tree. `card` is the triangle's (MeshFace), `name` the tree's in
// the shadow maps, and `word` that of its species. All corners of a leaf move alike, so that it keeps its shape.
vec3 blown(Motion m, uint word, uint name, uvec2 card, vec3 place) {
    vec3 anchor = place;
    if ((card.x | card.y) != 0u) {
        anchor = vec3(unpackHalf2x16(card.x), unpackHalf2x16(card.y).x);
        uint leaf = hash2(card.x ^ name, card.y);
        place = anchor + turned_about(place - anchor, card_axis(card.y >> 16u), leaf_flutter(m, leaf));
    }
    return swayed(word, place + branch_sway(m, anchor, name));
}

// A place of a model in the world, from the camera.
vec3 world_from_model(Tree t, vec3 place) { return t.centre + rotated(t.turn, place * t.scale); }
