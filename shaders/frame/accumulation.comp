// The mean of several frames, each shifted by a part of a pixel (Haeberli & Akeley 1990): one image of a frame, once a frame. The sums are
// kept between frames as floats; after the last, the image holds the mean. Twin of the shifts: src/frame/accumulation.rs.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"

layout(local_size_x = 64) in;
layout(binding = 0, rgba16f) uniform image2DArray shown;
layout(std430, binding = 1) buffer Sums { vec4 items[]; } sums;
layout(push_constant) uniform Push { AccumulationParameters p; };

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= p.pixels) return;
    ivec3 at = ivec3(k % p.width, k / p.width, 0);
    vec4 sum = imageLoad(shown, at);
    if (p.frame > 0u) sum += sums.items[p.first + k];
    if (p.part == 0.0) {
        sums.items[p.first + k] = sum;
    } else {
        imageStore(shown, at, sum * p.part);
    }
}
