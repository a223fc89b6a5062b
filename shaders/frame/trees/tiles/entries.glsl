// Lists of tiles: which trees' boxes reach into the pixels of which list, front to back. An entry is a tree in a list. Each of
// p.list_lanes invocations takes an equal part of all steps, in the order of trees, counts how many entries go into each list, and
// once a prefix sum over (list, part) has said where, writes them: no atomics, so the order stays. A step is an entry, or the end
// of a tree's entries: trees alone would be unequal parts, because the nearest are in thousands of lists, and entries alone would
// let one invocation pass over any number of trees that are in none.

layout(local_size_x = 8) in;
layout(std430, binding = 0) readonly buffer Boxes { uvec2 items[]; } boxes;
layout(std430, binding = 1) readonly buffer Spans { uint items[]; } spans; // steps before each tree's first
layout(std430, binding = 2) buffer Counts { uint items[]; } counts;
layout(std430, binding = 3) buffer State { TileState items[]; } state;
layout(push_constant) uniform Push { TileParameters p; };

// The tree to which a step belongs: the last whose first step is not behind it.
uint tree_of(uint step, uint trees) {
    uint low = 0u, high = trees;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (spans.items[middle] <= step) low = middle; else high = middle;
    }
    return low;
}

uvec4 lists_of(uint tree) {
    uvec2 b = boxes.items[tree];
    return box_lists(uvec4(b.x & 0xffffu, b.x >> 16u, b.y & 0xffffu, b.y >> 16u), p.list_shift);
}

uvec2 list_at(uvec4 box, uint within) {
    uint across = max(box.z - box.x, 1u);
    return box.xy + uvec2(within % across, within / across);
}

// Calls VISIT(list, tree) for each entry of this invocation's part.
#define FOR_ENTRIES(VISIT)                                                                              \
    uint lane = gl_GlobalInvocationID.x, trees = state.items[0].tree_count, total = spans.items[trees]; \
    uint part = total > p.step_capacity ? 0u : (total + p.list_lanes - 1u) / p.list_lanes;              \
    uint now = min(lane * part, total), last = min(now + part, total);                                  \
    uint tree = tree_of(now, trees), next = spans.items[tree + 1u];                                     \
    uvec4 box = lists_of(tree);                                                                         \
    uvec2 at = list_at(box, now - spans.items[tree]);                                                   \
    while (now < last) {                                                                                \
        if (at.y < box.w) {                                                                             \
            VISIT(at.y * p.lists.x + at.x, tree);                                                       \
        }                                                                                               \
        now++;                                                                                          \
        at = at.x + 1u < box.z ? uvec2(at.x + 1u, at.y) : uvec2(box.x, at.y + 1u);                      \
        if (now >= next && now < last) {                                                                \
            tree++;                                                                                     \
            next = spans.items[tree + 1u];                                                              \
            box = lists_of(tree);                                                                       \
            at = box.xy;                                                                                \
        }                                                                                               \
    }
