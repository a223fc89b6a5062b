// A quad of the terrain, read as texels. Needs interface.glsl.

TerrainQuad fetch_quad(usamplerBuffer quads, uint quad) {
    int at = int(quad) * 3;
    uvec4 a = texelFetch(quads, at), b = texelFetch(quads, at + 1), c = texelFetch(quads, at + 2);
    return TerrainQuad(ivec2(a.xy), int(a.z), a.w, uintBitsToFloat(b.xy), uintBitsToFloat(b.zw), uintBitsToFloat(c.x), c.y,
                       uintBitsToFloat(c.z), uintBitsToFloat(c.w));
}

// Where in its square of ground, in [0, 1], it has a place, m from the camera; `step` is the terrain's finest.
vec2 quad_place(TerrainQuad q, View v, vec2 place, float step) {
    return (vec2(v.grid_camera - q.corner) + (place + v.grid_offset) / step) / (float(q.spacing) * float(TERRAIN_CELLS));
}
