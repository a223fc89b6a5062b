// Exclusive prefix sums in place, with the total behind the last, in three steps: the sum of each block of SCAN_BLOCK counts, prefix sums
// of these, and those within each block. A workgroup takes a block, and an invocation a part of it without gaps.
const uint SCAN_LANES = 64u;
const uint SCAN_PART = SCAN_BLOCK / SCAN_LANES;

layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Sums { uint items[]; } sums;
layout(std430, binding = 1) readonly buffer State { TileState items[]; } state;
layout(std430, binding = 2) buffer Blocks { uint items[]; } blocks;
layout(push_constant) uniform Push { uint given; }; // 0: one a tree

shared uint parts[SCAN_LANES];

uint count_of_sums() { return given > 0u ? given : state.items[0].tree_count; }

// The counts of this invocation's part.
uvec2 own_part(uint count) {
    uint first = min(gl_WorkGroupID.x * SCAN_BLOCK + gl_LocalInvocationIndex * SCAN_PART, count);
    return uvec2(first, min(first + SCAN_PART, count));
}

uint part_sum(uvec2 part) {
    uint sum = 0u;
    for (uint k = part.x; k < part.y; k++) sum += sums.items[k];
    return sum;
}

// Sums of the workgroup's invocations before each, and of all.
uvec2 sums_before(uint own) {
    uint lane = gl_LocalInvocationIndex;
    parts[lane] = own;
    barrier();
    for (uint step = 1u; step < SCAN_LANES; step <<= 1u) {
        uint before = lane >= step ? parts[lane - step] : 0u;
        barrier();
        parts[lane] += before;
        barrier();
    }
    return uvec2(lane > 0u ? parts[lane - 1u] : 0u, parts[SCAN_LANES - 1u]);
}
