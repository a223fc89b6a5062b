// Pixels of a tile at which anything may be seen of a tree: those of its box at which one of its three views has any opacity where
// the search starts, by the views' outlines (src/physics/outline.rs). At the others the search would stay where it starts and find
// nothing.
//
// Where the ray of a pixel starts in a view is (U, V) / H, with U, V and H linear in the pixel's column and row. So u >= c, which is
// U - c H >= 0, holds in a row of pixels on one side of a column, and an interval of u from one column to another.

layout(constant_id = 3) const uint OUTLINE_ROWS = 16u;
layout(constant_id = 4) const uint VIEW_LEVELS = 9u;

// A function of the pixel: at the tile's first, and by how much it grows a column and a row.
float at_pixel(vec3 f, float column, float row) { return f.x + f.y * column + f.z * row; }

// Columns, of 0 to 8, at which f0 + f1 column >= 0, narrowing what there is.
void narrow(float f0, float f1, inout vec2 columns) {
    float root = -f0 / f1;
    if (f1 > 0.0) columns.x = max(columns.x, root);
    if (f1 < 0.0) columns.y = min(columns.y, root);
}

// The interval of u that a view has for heights from one to another, in rows: an outline's word holds one for two rows and one for four.
vec2 outline_interval(usamplerBuffer outlines, int first, float low, float high) {
    int row = int(clamp(low, 0.0, float(OUTLINE_ROWS - 1u))), rows = int(clamp(high, 0.0, float(OUTLINE_ROWS - 1u))) - row;
    uint word = texelFetch(outlines, first + row).x;
    uint bytes = rows < 2 ? word : (rows < 4 ? word >> 16u : 0xff00u);
    uint least = bytes & 0xffu, greatest = bytes >> 8u & 0xffu;
    return vec2(least == 0u ? -1e4 : float(least) * (1.0 / 128.0) - 0.5, greatest == 255u ? 1e4 : float(greatest) * (1.0 / 128.0) - 0.5);
}

// Eight bits a row of the tile, four rows a word. `box` is the tree's, from the tile's corner: first column and row, and those behind the last.
uvec2 outlined_pixels(usamplerBuffer outlines, Sight s, vec2 corner, ivec4 box) {
    vec2 d = corner + 0.5 - s.pixel;
    vec3 h = vec3(1.0 + dot(s.tilt, d), s.tilt);
    vec3 a = vec3(s.start.x + dot(s.across.xy, d), s.across.xy), b = vec3(s.start.y + dot(s.across.zw, d), s.across.zw);
    vec3 u[3], v[3];
    int first[3];
    vec3 layers = unpack_layers(s.layers, s.first);
    for (int k = 0; k < 3; k++) {
        u[k] = s.right[k].x * a + s.up[k].x * b + 0.5 * h;
        v[k] = float(OUTLINE_ROWS) * (s.right[k].y * a + s.up[k].y * b + 0.5 * h);
        first[k] = int((uint(layers[k]) * VIEW_LEVELS + s.mip) * OUTLINE_ROWS);
    }
    float west = float(box.x), east = float(box.z - 1);
    uint in_box = (1u << uint(box.z)) - (1u << uint(box.x));
    uvec2 pixels = uvec2(0u);
    for (int y = box.y; y < box.w; y++) {
        float row = float(y), west_h = at_pixel(h, west, row), east_h = at_pixel(h, east, row), h0 = h.x + h.z * row;
        uint columns = 0u;
        for (int k = 0; k < 3; k++) {
            float west_v = at_pixel(v[k], west, row) / west_h, east_v = at_pixel(v[k], east, row) / east_h;
            vec2 interval = outline_interval(outlines, first[k], min(west_v, east_v), max(west_v, east_v));
            float u0 = u[k].x + u[k].z * row;
            vec2 within = vec2(0.0, 7.0);
            narrow(u0 - interval.x * h0, u[k].y - interval.x * h.y, within);
            narrow(interval.y * h0 - u0, interval.y * h.y - u[k].y, within);
            ivec2 bounds = ivec2(clamp(vec2(ceil(within.x), floor(within.y) + 1.0), 0.0, 8.0));
            columns |= (1u << uint(bounds.y)) - (1u << uint(min(bounds.x, bounds.y)));
        }
        // Rays of pixels beyond the plane's horizon are the search's to judge.
        columns = min(west_h, east_h) > 1e-3 ? columns & in_box : in_box;
        pixels |= (y < 4 ? uvec2(columns, 0u) : uvec2(0u, columns)) << uint(8 * (y & 3));
    }
    return pixels;
}
