// Slices of a forest over the ground (Behrendt et al. 2005, section 3). Needs interface.glsl, `view`, physics/hash.glsl, land/wang.glsl and
// physics/handover.glsl.
//
// A stack has n slices, a power of two, and its slice k stands at (k + 1/2)/n of the stack's height; n + k numbers the slices of all stacks. With distance
// neighbours move together, two and two, and are one slice of the stack of half as many once they are in one place; what they hide together
// and what it hides are the same.

layout(std140, binding = 12) uniform Table { ShellTable t; } table;
layout(constant_id = 10) const uint COVER_CHANNELS = 4u; // of a coverage tile: 2 or four a layer

uint shell_code(uint slices, uint slice) { return slices + slice; }
uint shell_slices(uint code) { return 1u << uint(findMSB(code)); }
uint shell_slice(uint code) { return code - shell_slices(code); }
// Slices of all finer stacks of a tile come before those of one.
uint shell_layer(uint code, uint kind) {
    uint slices = shell_slices(code);
    return 16u * (2u * table.t.slices - 2u * slices) + kind * slices + shell_slice(code);
}

// log2 of a power of two, exactly: drivers' own may be a hair more.
float shell_steps(uint slices) { return float(findMSB(slices)); }

// log2 of the number of slices that there are at a distance; those of a fraction are on their way together.
float shell_detail(float distance) {
    float slices = table.t.height * view.v.pixels_at_1m / (max(distance, 1e-3) * table.t.spread);
    return clamp(log2(slices), 0.0, shell_steps(table.t.slices));
}

// Slices of the stack that a detail shows where a slice of a stack as fine or finer is drawn; interpolation may round it up.
uint shell_stack(float detail, uint code) { return min(1u << uint(ceil(detail)), shell_slices(code)); }

// The slice of a stack of so many of which one of a stack as fine or finer is a part.
uint shell_part(uint code, uint slices) { return shell_code(slices, shell_slice(code) / (shell_slices(code) / slices)); }

// Whether that is the one of its parts that shows it: the uppermost.
bool shell_shows(uint code, uint slices) { return (shell_slice(code) + 1u) % (shell_slices(code) / slices) == 0u; }

// Height of a slice over that of the stack, on its way to its neighbour.
float shell_height(uint code, float detail) {
    uint slices = shell_stack(detail, code);
    float own = (float(shell_slice(shell_part(code, slices))) + 0.5) / float(slices);
    uint fewer = max(slices >> 1u, 1u);
    float merged = (float(shell_slice(shell_part(code, fewer))) + 0.5) / float(fewer);
    return mix(own, merged, clamp(shell_steps(slices) - detail, 0.0, 1.0));
}

// A place of the forest: its Wang tile, and where in it, in tile sides.
struct ShellPlace {
    ivec2 tile;
    vec2 within;
};

ShellPlace shell_place(vec2 from_camera) {
    vec2 at = view.v.wang_offset + from_camera / table.t.tile_side, tile = floor(at);
    return ShellPlace(view.v.wang_camera + ivec2(tile), at - tile);
}

// Where a place is looked up in images of a slice. A filter there ends at the tile's edges, so within half a texel of one the tile beyond is looked up
// as well, and the two are mixed as a filter over both would: in the middle of an edge just so, in a corner without the two tiles beyond it.
struct ShellTexel {
    vec3 at, beyond;
    float part; // of what is beyond
};

// Of texels of a level of detail; `code` is the slice.
ShellTexel shell_texel(ShellPlace place, uint code, float level) {
    vec2 from_middle = place.within - 0.5, from_edge = 0.5 - abs(from_middle), side = mix(vec2(-1.0), vec2(1.0), greaterThan(from_middle, vec2(0.0)));
    vec2 across = from_edge.x < from_edge.y ? vec2(side.x, 0.0) : vec2(0.0, side.y);
    float part = 0.5 - min(from_edge.x, from_edge.y) * float(table.t.texels) * exp2(-max(level, 0.0));
    ShellTexel t = ShellTexel(vec3(place.within, float(shell_layer(code, wang_tile(table.t.seed, place.tile)))), vec3(0.0), max(part, 0.0));
    if (part > 0.0) t.beyond = vec3(place.within - across, float(shell_layer(code, wang_tile(table.t.seed, place.tile + ivec2(across)))));
    return t;
}

vec4 shell_fetch(sampler2DArray image, ShellTexel t, float level) {
    vec4 here = textureLod(image, t.at, level);
    return t.part > 0.0 ? mix(here, textureLod(image, t.beyond, level), t.part) : here;
}

// Level of detail, of texels as large as a pixel is wide on the slice: `area` is what a pixel spans of it, in tile sides squared.
float shell_level(float area) {
    return clamp(0.5 * log2(max(area, 1e-20)) + log2(float(table.t.texels)) + view.v.footprint, -8.0, log2(float(table.t.texels)));
}

// The share of the full density at which trees stand as slices at a distance: `channels` are those of a coverage tile there.
float shell_share(vec4 channels[COVER_GROUPS], float distance) {
    float share = 0.0;
    for (uint g = 0u; 4u * g < COVER_CHANNELS; g++) {
        vec4 relative = mix(vec4(1.0), distance * table.t.nearness[g], greaterThan(table.t.nearness[g], vec4(0.0)));
        share += dot(channels[g] * table.t.shares[g], handed_over(relative));
    }
    return clamp(share, 0.0, 1.0);
}

// Cover at a share of the full density, from that at a quarter, a half, three quarters and all of it.
float shell_cover(vec4 covers, float share) {
    vec4 below = vec4(0.0, covers.xyz), part = clamp(4.0 * share - vec4(0.0, 1.0, 2.0, 3.0), 0.0, 1.0);
    return dot(part, covers - below);
}

// What a ray that goes through the slab of a slice meets of it, whose cover is as it is seen from above: the longer its way, the more.
// `rise` is the cosine of its angle with the ground's normal over that of the vertical with it.
float shell_opacity(float cover, float rise) { return 1.0 - pow(max(1.0 - cover, 0.0), 1.0 / max(rise, 1.0 / 64.0)); }

// Crowns stand where gusts have moved them to: a slice is looked up as much behind.
vec2 shell_sway(vec2 from_camera, float height) {
    vec2 sway = vec2(0.0);
    if (WIND) sway = height * view.v.wind.z * gusts_at(view.v.wind.xy, view.v.wind_here.xyz, from_camera) * view.v.wind.xy;
    return sway;
}
