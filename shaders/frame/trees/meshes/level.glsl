// A corner of a leaf at the share of the leaves that is drawn of its tree: moved away from the middle of its card, or towards it, and the card towards the middle of all.
// Where all are drawn, and of bark, as it is. Needs interface.glsl and physics/levels.glsl.

// Middle of a card, from its 10 bits along each axis of the tree's box.
vec3 card_middle(uint bits, vec3 box) {
    return (vec3(uvec3(bits, bits >> 10u, bits >> 20u) & 1023u) * (2.0 / 1023.0) - 1.0) * box;
}

vec3 levelled(vec3 place, uvec4 face, MeshTree shown, vec3 box, vec3 all) {
    bool moved = face.y != 0u && shown.share < 1.0;
    vec3 middle = card_middle(face.w, box);
    return moved ? mix(all, middle, shown.pull) + (place - middle) * card_scale(uintBitsToFloat(face.z), shown.share) : place;
}
