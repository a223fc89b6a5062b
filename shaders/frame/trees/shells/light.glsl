// Light on slices of a forest where samples see them, once a pixel and slice: what is painted there, by the transfer of the trees' own crowns as
// spherical harmonics of where light comes from, and what other trees leave of it (Behrendt et al. 2005, section 4; Sloan et al. 2002).
#include "physics/hash.glsl"
#include "physics/light.glsl"
#include "physics/shadow.glsl"
#include "physics/harmonics.glsl"
#include "physics/received.glsl"
#include "physics/correction.glsl"
#include "physics/handover.glsl"
#include "physics/indirect.glsl"
#include "land/wang.glsl"
#include "forest/wind.glsl"
#include "frame/quad.glsl"
#include "frame/surfaces_seen.glsl"
#include "frame/camera.glsl"
#include "frame/samples.glsl"
#include "frame/view_mode.glsl"
#include "frame/trees/zfield_mode.glsl"
#include "frame/shown.glsl"
#include "frame/tile.glsl"

layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
#include "frame/trees/shells/shell.glsl"
layout(binding = 1) uniform usamplerBuffer quads;
layout(binding = 3) uniform sampler2DArray cover_tiles;
layout(binding = 4) uniform sampler2DArray covers;
layout(binding = 5) uniform sampler2DArray reflectances;   // and share of leaves
layout(binding = 6) uniform sampler2DArray transmittances; // and height
layout(binding = 25) uniform sampler2DArray light_0;        // how light comes to that, four numbers each
layout(binding = 26) uniform sampler2DArray light_1;
layout(binding = 27) uniform sampler2DArray light_2;
layout(binding = 28) uniform sampler2DArray light_3;
layout(binding = 29) uniform sampler2DArray light_4;
layout(binding = 30) uniform sampler2DArray light_5;
layout(binding = 31) uniform sampler2DArray light_6;
layout(binding = 9) uniform sampler2DArray slope_tiles;
layout(binding = 13) uniform sampler2DArray shadow_map;
layout(binding = 15) uniform samplerBuffer indirect;
layout(push_constant) uniform Push { ShellLightParameters p; };
layout(constant_id = 1) const bool HAS_SUN = true;
layout(constant_id = 4) const bool INDIRECT = false;
layout(constant_id = 6) const bool SHADOWED = true;       // there are shadow maps
layout(constant_id = 7) const int INDIRECT_FIRST = 0;     // texel where the first species' begins
layout(constant_id = 8) const int INDIRECT_NODES = 2;     // of the density
layout(constant_id = 9) const uint SPECIES_COUNT = 1u;

// What a texel has kept of light: the transfer to the side that faces up and to the other, and what other trees leave of a direction.
struct ShellLight {
    float up[9], down[9], free[9];
    float open; // share of the sky that they leave
};

ShellLight shell_light(ShellTexel at, float level, float cover) {
    vec4 c[7] = vec4[](shell_fetch(light_0, at, level), shell_fetch(light_1, at, level), shell_fetch(light_2, at, level), shell_fetch(light_3, at, level),
                       shell_fetch(light_4, at, level), shell_fetch(light_5, at, level), shell_fetch(light_6, at, level));
    for (int k = 0; k < 7; k++) c[k] /= cover;
    ShellLight l;
    l.up = float[](c[0].x, c[0].y, c[0].z, c[0].w, c[1].x, c[1].y, c[1].z, c[1].w, c[2].x);
    l.down = float[](c[2].y, c[2].z, c[2].w, c[3].x, c[3].y, c[3].z, c[3].w, c[4].x, c[4].y);
    l.free = float[](c[4].z, c[4].w, c[5].x, c[5].y, c[5].z, c[5].w, c[6].x, c[6].y, c[6].z);
    l.open = c[6].w;
    for (int i = 0; i < 9; i++) {
        l.up[i] *= TRANSFER_SCALE;
        l.down[i] *= TRANSFER_SCALE;
        l.free[i] *= FREE_SCALE;
    }
    return l;
}

// Zonal harmonics of a sky of radiance 1 all over the upper hemisphere.
const vec3 EVEN_SKY = vec3(1.7724539, 1.5349901, 0.0);

float direction_left(float free[9], vec3 l) {
    float y[9], left = 0.0;
    harmonics(l, y);
    for (int i = 0; i < 9; i++) left += y[i] * free[i];
    return clamp(left, 0.0, 1.0);
}

// A slope is level ground that is sheared along the vertical, and trees stand upright on both: what they hide from each other along a direction, they
// hide on level ground along the direction that is sheared back. `w` points away from the ground of normal n.
vec3 over_level(vec3 w, vec3 n) { return normalize(vec3(w.xy, max(dot(w, n), 0.0) / n.z)); }

// What texels leave out of the sun on the side that is seen, and on the other one, by the directions of viewer and sun and the share of
// the density (src/bake/shells/sun.rs).
vec2 seen_sun(float viewer, float sun, float angle, float share) {
    CorrectionTerms y = phase_terms(viewer, sun, angle);
    vec2 over;
    for (int k = 0; k < 2; k++) {
        vec4 c[5] = vec4[](table.t.sun[5 * k], table.t.sun[5 * k + 1], table.t.sun[5 * k + 2], table.t.sun[5 * k + 3], table.t.sun[5 * k + 4]);
        over[k] = shell_correction(c, y, share);
    }
    return over;
}

// Sunlight on what hills leave to it: looked up as high as nothing stands, so that trees do not count twice.
float hills_leave(vec3 world, float height, float distance) {
    if (!SHADOWED) return 1.0;
    uint c = cascade_at(view.v.cascade_far, view.v.cascade_count, distance);
    if (c == MAX_CASCADES) return 1.0;
    vec3 from = world + vec3(0.0, 0.0, table.t.height - height) + view.v.sun_direction * (2.0 * view.v.cascade_texel[c]);
    vec3 at = (view.v.cascade_from_world[c] * vec4(from, 1.0)).xyz;
    return sun_visibility(shadow_map, at, vec2(0.0), view.v.cascade_turn[c].xy, c, NO_TREE, 0.0);
}

// What a slice shows to a pixel, at a place of the world from the camera.
Shown shade(uint what, vec3 world) {
    View v = view.v;
    TerrainQuad q = fetch_quad(quads, shell_quad(what));
    uint code = shell_of(what);
    float far = length(world);
    vec3 toward = world * (-1.0 / max(far, 1e-6)), l = v.sun_direction;
    vec2 within = quad_place(q, v, world.xy, p.step);
    vec2 slope_at = (clamp(within, 0.0, 1.0) * float(TERRAIN_SLOPES - 1u) + 0.5) / float(TERRAIN_SLOPES);
    vec3 n = normalize(vec3(-textureLod(slope_tiles, vec3(slope_at, float(q.layer)), 0.0).rg, 1.0));
    float height = table.t.height * shell_height(code, min(shell_detail(far), shell_steps(shell_slices(code))));
    ShellPlace at = shell_place(world.xy - shell_sway(world.xy, height));
    // What a pixel spans of the slice: a square of the ray's distance, seen askew.
    float side = far / (v.pixels_at_1m * table.t.tile_side), level = max(shell_level(side * side * abs(n.z / max(abs(dot(n, toward)), 0.02))), 0.0);
    ShellTexel texel = shell_texel(at, code, level);
    float cover = max(shell_fetch(covers, texel, level).w, 1.0 / 255.0);
    vec4 reflected = shell_fetch(reflectances, texel, level) / cover, passed = shell_fetch(transmittances, texel, level) / cover;
    // Light is premultiplied by the cover of texels as large as its own.
    float light_level = max(level - p.larger, 0.0), light_cover_level = light_level + p.larger;
    ShellTexel light_texel = shell_texel(at, code, light_cover_level);
    ShellLight light = shell_light(light_texel, light_level, max(shell_fetch(covers, light_texel, light_cover_level).w, 1.0 / 255.0));
    vec3 reflectance = min(reflected.rgb, 1.0) * table.t.reflectance / PI, transmittance = min(passed.rgb, 1.0) * table.t.transmittance / PI;
    vec4 channels[COVER_GROUPS];
    for (uint g = 0u; g < COVER_GROUPS; g++) channels[g] = vec4(0.0);
    for (uint g = 0u; 4u * g < COVER_CHANNELS; g++) {
        channels[g] = textureLod(cover_tiles, vec3(q.cover_offset + q.cover_scale * within, float(q.cover_layer + g)), 2.0);
    }
    float share = 0.0, thickness = 0.0;
    for (uint g = 0u; g < COVER_GROUPS; g++) share += dot(channels[g], table.t.shares[g]);
    for (uint k = 0u; k < SPECIES_COUNT; k++) thickness += channels[(k + 1u) >> 2u][(k + 1u) & 3u];
    share = clamp(share, 0.0, 1.0);
    Received own = received(light.up, light.down, l, EVEN_SKY);
    float upper = 0.5 + 0.5 * toward.z;
    vec2 sky = vec2(mix(own.sky.y, own.sky.x, upper), mix(own.sky.x, own.sky.y, upper)) * (pow(clamp(light.open, 0.0, 1.0), share) * sky_over_slope(n.z, thickness));
    vec3 sky_part = (reflectance * sky.x + transmittance * sky.y) * v.sky_radiance;
    vec3 sun_part = vec3(0.0);
    float lit = 0.0;
    if (HAS_SUN) {
        float angle = angle_between(toward, l);
        vec3 level_sun = over_level(l, n);
        vec2 seen = side_seen(angle), above = side_seen(angle_between(vec3(0.0, 0.0, 1.0), l)), over = seen_sun(over_level(toward, n).z, level_sun.z, angle, share);
        // Seen from above it is the transfer; from elsewhere leaves show as much more of their light as uniform ones would.
        float both = (own.sun.x + own.sun.y) * seen.x / above.x;
        lit = pow(direction_left(light.free, level_sun), share) * sun_facing(l, n) * hills_leave(world, height, far);
        sun_part = (lit * both) * (reflectance * (over.x * seen.y) + transmittance * (over.y * (1.0 - seen.y))) * v.sun_irradiance;
    }
    if (INDIRECT) {
        IndirectAt node = indirect_at(thickness, texelFetch(indirect, 0).w, INDIRECT_NODES);
        for (uint k = 0u; k < SPECIES_COUNT; k++) {
            float part = channels[(k + 1u) >> 2u][(k + 1u) & 3u] / max(thickness, 1e-9);
            int base = INDIRECT_FIRST + int(k) * INDIRECT_NODES * INDIRECT_NODE;
            sky_part += part * indirect_far_sky(indirect, base, node, toward.z) * v.sky_radiance;
            if (HAS_SUN) sun_part += (part * sun_facing(l, n)) * indirect_far_sun(indirect, base, node, toward.z, l.z, dot(toward, l)) * v.sun_irradiance;
        }
    }
#ifdef LAYERS
    return Shown(vec4(sun_part, 1.0), vec4(sky_part, 1.0), vec4(0.0, 0.0, lit, 1.0 - lit));
#else
    if (VIEW_MODE != 0u) return Shown(vec4(tree_mode(SHELL_DRAW, SHADOWED ? cascade_at(v.cascade_far, v.cascade_count, far) : MAX_CASCADES, lit), 1.0));
    return Shown(vec4(sun_part + sky_part, 1.0));
#endif
}

bool is_mine(uint what) { return is_shell(what); }
// The light of all others is there before.
bool is_stored(uint what) { return !is_shell(what); }
uint species_seen(uint what) { return SPECIES_COUNT == 1u ? 1u : 0u; }

#include "frame/trees/near_pixels.glsl"
