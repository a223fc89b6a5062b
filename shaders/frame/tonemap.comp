// Linear radiance to 8-bit sRGB: the only place where values are not linear.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/tonemap.glsl"

layout(local_size_x = 64) in;
layout(binding = 0) uniform sampler2DArray radiance;
layout(binding = 1) uniform sampler2DArray second_part;
layout(std430, binding = 2) writeonly buffer Picture { uint items[]; } picture;
layout(push_constant) uniform Push { TonemapParameters p; };

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= p.size.x * p.size.y) return;
    ivec3 at = ivec3(k % p.size.x, k / p.size.x, 0);
    vec3 c = texelFetch(radiance, at, 0).rgb;
    if (p.parts == 2u) c += texelFetch(second_part, at, 0).rgb;
    // A view mode's colours are shown as they are.
    if (p.parts > 0u) c = tone_curve(c * p.exposure);
    picture.items[k] = packUnorm4x8(vec4(srgb(clamp(c, 0.0, 1.0)), 1.0));
}
