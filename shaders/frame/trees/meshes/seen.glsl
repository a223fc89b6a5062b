// What a sample sees, where that is a mesh: one of the trees that are meshes, and a triangle of its model. Quads of the ground, which
// have the same words, are no such.

bool is_mesh(uint seen) { return (seen & MESH_SEEN) != 0u; }
uint mesh_seen(uint tree, uint triangle) { return MESH_SEEN | tree << 19u | triangle; }
uint seen_tree(uint seen) { return seen >> 19u & (MESH_TREES - 1u); }
uint seen_triangle(uint seen) { return seen & (MESH_TRIANGLES - 1u); }
