// What a sample sees, where that is of trees: a mesh, one of the trees that are such and a triangle of its model; a card of a tree's cloud; or a slice of
// the forest over a quad of the ground. Quads of the ground, which have the same words, are none of these.

bool is_mesh(uint seen) { return (seen & MESH_SEEN) != 0u; }
bool is_card(uint seen) { return (seen & (MESH_SEEN | CARD_SEEN)) == CARD_SEEN; }
bool is_shell(uint seen) { return (seen & (MESH_SEEN | CARD_SEEN | SHELL_SEEN)) == SHELL_SEEN; }
bool is_ground(uint seen) { return (seen & (MESH_SEEN | CARD_SEEN | SHELL_SEEN)) == 0u; }
uint shell_seen(uint quad, uint slice) { return SHELL_SEEN | quad << 6u | slice; }
uint shell_quad(uint seen) { return (seen & ~SHELL_SEEN) >> 6u; }
uint shell_of(uint seen) { return seen & 63u; }
uint card_seen(uint tree, uint card) { return CARD_SEEN | tree << 9u | card; }
uint card_tree(uint seen) { return seen >> 9u & (CARD_TREES - 1u); }
uint card_of(uint seen) { return seen & (MOST_CARDS - 1u); }
uint mesh_seen(uint tree, uint triangle) { return MESH_SEEN | tree << 19u | triangle; }
uint seen_tree(uint seen) { return seen >> 19u & (MESH_TREES - 1u); }
uint seen_triangle(uint seen) { return seen & (MESH_TRIANGLES - 1u); }
