// Radiance of the ground and the sky.
#include "frame/ground_seen.glsl"

void main() {
    uvec2 size = uvec2(imageSize(radiance).xy), corner = gl_WorkGroupID.xy * TILE_SIDE;
    uint column = gl_LocalInvocationIndex;
    list_pixels(corner, column, size);
    barrier();
    uint total = 0u;
    for (uint c = 0u; c < 8u; c++) total += counts[c];
    for (uint i = column; i < total; i += 8u) {
        uint found = item(i);
        ivec2 pixel = ivec2(corner + uvec2(found & 7u, found >> 3u & 7u));
        uint seen = found >> 8u & 0xffu, open = found >> 16u;
        GroundLight g = light_of(pixel, seen, vec2(size));
        vec3 sky = SKY_IMAGE ? imageLoad(radiance, ivec3(pixel, 0)).rgb : view.v.sky_radiance;
        vec3 sum = float(bitCount(seen)) * (g.sun + g.sky) + float(bitCount(open & ~seen)) * sky;
        imageStore(radiance, ivec3(pixel, 0), vec4(sum * (1.0 / float(SAMPLES)), 1.0));
    }
}
