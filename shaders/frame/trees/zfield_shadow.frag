// Depth at which one tree stops the sun's light (BN12, section 5). A texel holds one tree, and the opacity of others behind it would be
// lost, more of it the coarser the map. So opacity is the probability of being there: behind several trees the expected light is then
// the product of what each lets through. BN12 have the tree's back there, so that no tree shadows its own lit side; but trees
// grow into each other, and one whose back lies lower than a point would shadow nothing of it, however much of its crown is above (in a dense forest
// of oaks, 0.04 of the trees too many were lit). Light on its way through an even crown of opacity a is stopped within the part t of it with the
// probability 1 - (1 - a)^t: with u the number that says whether it is stopped at all, there. What is on the tree itself knows its name.
// Texels of the view are about as large as the map's, and each of those holds one depth: the nearest one of the view is as good as
// a mean of four, and costs a driver that filters in software a quarter.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/hash.glsl"
#define VIEW_SAMPLE(views, at, layer, mip) (at == clamp(at, 0.0, 1.0) ? view_texel(views, at, layer, int(mip)) : vec4(0.0))
#include "physics/zfield.glsl"
#include "physics/shadow.glsl"

layout(location = 0) in vec3 light_p[3];
layout(location = 3) in float depth;
layout(location = 4) flat in vec4 light_d[3];
layout(location = 7) flat in vec3 optics;
layout(location = 8) flat in float depth_per_metre;
layout(location = 9) flat in uint dither;
layout(binding = 5) uniform sampler2DArray views;

void main() {
    vec3 p[3], d[3];
    for (int i = 0; i < 3; i++) {
        p[i] = light_p[i];
        d[i] = light_d[i].xyz;
    }
    vec3 layers = vec3(light_d[0].w, light_d[1].w, light_d[2].w);
    vec3 w = vec3(optics.xy, 1.0 - optics.x - optics.y);
    vec3 inverse_depth = 1.0 / vec3(d[0].z, d[1].z, d[2].z);
    Surface back = zfield_fetch(views, p, d, inverse_depth, layers, w, optics.z, 0.0, true, false);
    // The map is world-fixed, and so is what is drawn to it. Texels side by side get dithers far apart: steps of the plastic number's powers (Roberts 2018, "R2 sequence").
    uvec2 at = uvec2(gl_FragCoord.xy);
    float u = unit(dither + at.x * 3242174889u + at.y * 2447445413u);
    if (back.opacity <= u) discard;
    Surface front = zfield_fetch(views, p, d, inverse_depth, layers, w, optics.z, 0.0, false, false);
    float part = clamp(log(1.0 - u) / log(1.0 - min(back.opacity, 0.999)), 0.0, 1.0);
    gl_FragDepth = named_depth(clamp(depth + mix(front.s, back.s, part) * depth_per_metre, 0.0, 1.0), dither);
}
