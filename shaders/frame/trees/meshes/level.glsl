// A corner of a leaf at the share of the leaves that is drawn of its tree: moved away from the middle of its card, or towards it, and the card towards the middle of all.
// Where all are drawn, and of bark, as it is. Needs interface.glsl, physics/levels.glsl and
// frame/trees/meshes/corner.glsl.

vec3 levelled(vec3 place, uvec4 face, MeshTree shown, vec3 box, vec3 all) {
    bool moved = is_leaf(face) && shown.share < 1.0;
    vec3 middle = leaf_middle(face.w, box);
    return moved ? mix(all, middle, shown.pull) + (place - middle) * card_scale(uintBitsToFloat(face.z), shown.share) : place;
}
