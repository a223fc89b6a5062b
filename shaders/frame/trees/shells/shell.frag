// The slice of a forest that a sample sees, where a tree is in it.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#include "physics/handover.glsl"
#include "land/wang.glsl"
#include "forest/wind.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 3) uniform sampler2DArray cover_tiles;
layout(binding = 4) uniform sampler2DArray covers;
layout(constant_id = 11) const uint COVER_SIDE = 256u; // texels along a side of a coverage tile
#include "frame/trees/near_seen.glsl"
#include "frame/trees/shells/shell.glsl"
layout(constant_id = 0) const uint SAMPLES = 4u;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 cover_at;
layout(location = 2) in vec2 detail_height;
layout(location = 3) flat in uvec3 what;
layout(location = 0) out uint seen;

// A number in [0, 1) for the places of a slice: one for what a pixel spans of it, which stays where it is while the camera moves.
float shell_dither(ShellPlace at, float level, uint code) {
    float whole = floor(level + 0.5), side = float(table.t.texels) * exp2(-whole);
    ivec2 cell = at.tile * int(max(side, 1.0)) + ivec2(at.within * side);
    return unit(hash2(hash2(uint(cell.x), uint(cell.y)), code | uint(whole + 16.0) << 8u) + view.v.dither_turn);
}

void main() {
    float far = length(position);
    vec3 x = dFdx(position), y = dFdy(position), n = normalize(cross(x, y));
    uint slices = shell_stack(detail_height.x, what.y), code = shell_part(what.y, slices);
    ShellPlace at = shell_place(position.xy - shell_sway(position.xy, detail_height.y));
    float level = shell_level(abs(x.x * y.y - x.y * y.x) / (table.t.tile_side * table.t.tile_side));
    vec4 all = shell_fetch(covers, shell_texel(at, code, level), max(level, 0.0));
    // The mean over what a pixel spans of the ground, as the ground itself is looked up.
    vec2 dx = dFdx(cover_at.xy), dy = dFdy(cover_at.xy);
    float footprint = 0.5 * log2(max(max(dot(dx, dx), dot(dy, dy)), 1e-30)) + log2(float(COVER_SIDE)) + view.v.footprint;
    vec4 channels[COVER_GROUPS];
    for (uint g = 0u; g < COVER_GROUPS; g++) channels[g] = vec4(0.0);
    for (uint g = 0u; 4u * g < COVER_CHANNELS; g++) {
        channels[g] = textureLod(cover_tiles, vec3(cover_at.xy, float(what.z + g)), clamp(footprint, cover_at.z, 3.0));
    }
    float share = shell_share(channels, far), rise = abs(dot(n, position)) / max(far * abs(n.z), 1e-6);
    float opacity = shell_opacity(shell_cover(all, share), rise), dither = shell_dither(at, level, code);
    uint some = 0u;
    for (uint k = 0u; k < SAMPLES; k++) some |= opacity > fract(dither + float(k) / float(SAMPLES)) ? 1u << k : 0u;
    seen = shell_seen(what.x, code);
    gl_SampleMask[0] = shell_shows(what.y, slices) ? int(some) : 0;
}
