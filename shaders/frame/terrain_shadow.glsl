// Squares of ground, seen by the sun: one block of a cascade a draw; where LAYERED its layer is chosen here. Every vertex is placed
// from the corner of the square that begins with it, so that squares side by side agree on it to the bit.
#include "physics/terrain.glsl"

layout(std430, binding = 0) readonly buffer Squares { GroundCaster items[]; } squares;
layout(binding = 1) uniform sampler2DArray heights;
layout(push_constant) uniform Push { ShadowBlock block; vec2 last; float step; float texels_per_step; };

void main() {
    GroundCaster q = squares.items[gl_InstanceIndex];
    ivec2 at = ivec2(gl_VertexIndex % (SHADOW_CELLS + 1u), gl_VertexIndex / (SHADOW_CELLS + 1u));
    ivec2 next = at / int(SHADOW_CELLS);
    // The terrain ends at its last sample.
    vec2 grid = min(vec2(q.corner + at * q.spacing), last);
    vec2 within = (grid - vec2(q.corner + next * int(SHADOW_CELLS) * q.spacing)) * step;
    vec2 texel = grid * texels_per_step, cell = floor(texel);
    vec3 m = vec3(within, height_and_slope(heights, ivec2(cell), texel - cell).x - block.ground);
    vec3 place = q.corners[next.y * 2 + next.x].xyz + vec3(dot(block.x, m), dot(block.y, m), dot(block.z, m));
    // Ground before the cascade's near side casts from there.
    gl_Position = vec4(place.xy * block.to_clip - 1.0, min(place.z, 1.0), 1.0);
#ifdef LAYERED
    gl_Layer = int(block.cascade);
#endif
}
