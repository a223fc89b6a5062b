// What a sample sees, where that is of a tree: a mesh, one of the trees that are such and a triangle of its model; or a card of a tree's cloud. Quads
// of the ground, which have the same words, are neither.

bool is_mesh(uint seen) { return (seen & MESH_SEEN) != 0u; }
bool is_card(uint seen) { return (seen & (MESH_SEEN | CARD_SEEN)) == CARD_SEEN; }
bool is_ground(uint seen) { return (seen & (MESH_SEEN | CARD_SEEN)) == 0u; }
uint card_seen(uint tree, uint card) { return CARD_SEEN | tree << 9u | card; }
uint card_tree(uint seen) { return seen >> 9u & (CARD_TREES - 1u); }
uint card_of(uint seen) { return seen & (MOST_CARDS - 1u); }
uint mesh_seen(uint tree, uint triangle) { return MESH_SEEN | tree << 19u | triangle; }
uint seen_tree(uint seen) { return seen >> 19u & (MESH_TREES - 1u); }
uint seen_triangle(uint seen) { return seen & (MESH_TRIANGLES - 1u); }
