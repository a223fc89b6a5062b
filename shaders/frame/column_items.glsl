// Items of a tile that every invocation listed for its column of pixels, and that all then work through in turn.

shared uint counts[8]; // of each column

uint item_count() {
    uint total = 0u;
    for (uint c = 0u; c < 8u; c++) total += counts[c];
    return total;
}

// Where item i of the tile is, counted column after column, each with room for `most`: its column is slot / most.
uint item_slot(uint i, uint most) {
    uint slot = 0u, before = 0u;
    for (uint c = 0u; c < 8u; c++) {
        uint count = counts[c];
        if (i >= before && i < before + count) slot = c * most + i - before;
        before += count;
    }
    return slot;
}
