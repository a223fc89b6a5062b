// Which seeds of a workgroup are in which list: a ballot in shared memory, 256 bits a list.

shared uint members[TREE_LISTS * 8];

void clear_members(uint thread) {
    for (uint k = thread; k < TREE_LISTS * 8u; k += CULL_GROUP) members[k] = 0u;
    barrier();
}

// Puts a seed of this class into its lists; the order of the atomics does not change the bits.
void enlist(uint seen, uint thread) {
    uint word = thread >> 5u, bit = 1u << (thread & 31u);
    if (seen == 0u) return;
    atomicOr(members[word], bit);
    atomicOr(members[(1u + (seen & 31u)) * 8u + word], bit);
}
