// Corners of a model's triangles: the place from the middle of the tree's box, m, and the texture coordinates, 16 bits each. Needs physics/hash.glsl and
// forest/wind.glsl.

const float UV_STEPS = 2048.0; // a texture

vec3 corner_place(uvec4 corner) { return uintBitsToFloat(corner.xyz); }
vec2 corner_uv(uvec4 corner) { return vec2(corner.w & 0xffffu, corner.w >> 16u) * (1.0 / UV_STEPS); }

// Middle of a leaf, from its 10 bits along each axis of the tree's box.
vec3 leaf_middle(uint bits, vec3 box) { return (vec3(uvec3(bits, bits >> 10u, bits >> 20u) & 1023u) * (2.0 / 1023.0) - 1.0) * box; }

bool is_leaf(uvec4 face) { return (face.y & 1u) != 0u; }
bool turns_in_wind(uvec4 face) { return (face.y & 2u) != 0u; }

// A place of a leaf that the wind has turned about the leaf's middle, in the model's own axes; of others, as it is. `face` is the triangle (MeshFace), `name` the
// tree's in the shadow maps, and `box` the half extents of its box. All corners of a leaf turn alike, so that it keeps its shape.
vec3 turned_leaf(Motion m, uint name, uvec4 face, vec3 box, vec3 place) {
    vec3 middle = leaf_middle(face.w, box);
    vec3 turned = middle + turned_about(place - middle, card_axis(face.y >> 16u), leaf_flutter(m, hash2(face.w ^ name, face.y)));
    return turns_in_wind(face) ? turned : place;
}

// Where the wind carries a place of a leaf that it has turned, or of bark: a leaf goes with the branch that holds its middle; all then leans with the
// tree, from where the middle of the box is moved to. `word` is that of the tree's species.
vec3 carried(Motion m, uint word, uint name, uvec4 face, vec3 box, vec3 place) {
    vec3 anchor = turns_in_wind(face) ? leaf_middle(face.w, box) : place;
    return swayed(word, place + branch_sway(m, anchor, name));
}

// Where the wind moves a place of the whole model to.
vec3 blown(Motion m, uint word, uint name, uvec4 face, vec3 box, vec3 place) {
    return carried(m, word, name, face, box, turned_leaf(m, name, face, box, place));
}

// A place of a model in the world, from the camera.
vec3 world_from_model(Tree t, vec3 place) { return t.centre + rotated(t.turn, place * t.scale); }
