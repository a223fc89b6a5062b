// Back depth and opacity of one tree as the sun sees it (BN12, section 5): the back, so that no tree shadows its own lit
// side, and both in one texel, so that depth and opacity are always of the same tree.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "physics/zfield.glsl"
#include "physics/shadow.glsl"

layout(location = 0) in vec3 light_p[3];
layout(location = 3) in float depth;
layout(location = 4) flat in vec4 light_d[3];
layout(location = 7) flat in vec4 optics;
layout(location = 8) flat in float depth_per_metre;
layout(binding = 5) uniform sampler2DArray views;
layout(location = 0) out uint caster;

void main() {
    vec3 p[3], d[3];
    for (int i = 0; i < 3; i++) {
        p[i] = light_p[i];
        d[i] = light_d[i].xyz;
    }
    vec3 layers = vec3(light_d[0].w, light_d[1].w, light_d[2].w);
    vec3 w = vec3(optics.xy, 1.0 - optics.x - optics.y);
    Surface back = zfield_fetch(views, p, d, 1.0 / vec3(d[0].z, d[1].z, d[2].z), layers, w, optics.z, 0.0, true, false);
    float opacity = back.opacity * optics.w;
    if (opacity < 1.0 / 64.0) discard;
    float z = clamp(depth + back.s * depth_per_metre, 0.0, 1.0);
    gl_FragDepth = z;
    caster = pack_caster(z, opacity);
}
