// From the world to the scaled space of one tree, where its z-field lives.

// Rotation back by the tree's turn.
mat3 tree_rotation(Tree t) {
    return mat3(t.turn.x, -t.turn.y, 0.0, t.turn.y, t.turn.x, 0.0, 0.0, 0.0, 1.0);
}

// A point of scaled tree space in the world, from the camera.
vec3 world_from_tree(Tree t, Species kind, vec3 p) {
    vec3 m = p * kind.scale_to_metres * t.scale;
    return t.centre + vec3(t.turn.x * m.x - t.turn.y * m.y, t.turn.y * m.x + t.turn.x * m.y, m.z);
}

// A point or direction in a view: (u - 1/2, v - 1/2, depth).
vec3 project(ViewBasis b, vec3 p) { return vec3(dot(b.u.xyz, p), dot(b.v.xyz, p), dot(b.depth.xyz, p)); }

// Horizontal and upward unit vectors across a direction w.
void frame_across(vec3 w, out vec3 right, out vec3 up) {
    float radial = length(w.xy);
    right = radial > 1e-6 ? vec3(-w.y, w.x, 0.0) / radial : vec3(0.0, 1.0, 0.0);
    up = cross(w, right);
}
