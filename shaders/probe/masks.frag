// Overlapping trees of one opacity, each pixel with trees of its own: what share of the samples do they cover?
#version 450
#extension GL_GOOGLE_include_directive : require
#include "physics/hash.glsl"
#include "physics/masks.glsl"

layout(location = 0) flat in uint tree;
layout(location = 0) out vec4 covered;
layout(std430, binding = 0) readonly buffer Masks { uvec4 items[]; } masks;
layout(push_constant) uniform Push { float alpha; uint seed; };
layout(constant_id = 2) const uint MASK_ROWS = 12u;
layout(constant_id = 3) const uint SAMPLES = 4u;

void main() {
    // Identities as seeds have them: hashes of the scene's seed and a place.
    uint identity = hash2(seed, hash2(uint(gl_FragCoord.x), hash2(uint(gl_FragCoord.y), tree)));
    uvec3 row = masks.items[hash(identity ^ HASH_MASK) % MASK_ROWS].xyz;
    uint count = covered_samples(alpha, unit(hash(identity ^ HASH_DITHER)), SAMPLES);
    gl_SampleMask[0] = int(mask_column(row, count, SAMPLES));
    covered = vec4(1.0);
}
