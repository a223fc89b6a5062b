// Integer hashes: the only source of randomness in shaders. Twin: src/physics/hash.rs.

// PCG output permutation (Jarzynski & Olano 2020, "Hash Functions for GPU Rendering").
uint hash(uint v) {
    uint s = v * 747796405u + 2891336453u;
    uint w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u;
    return (w >> 22u) ^ w;
}

uint hash2(uint a, uint b) { return hash(a + hash(b)); }

// Uniform in [0, 1), exact multiples of 2^-24.
float unit(uint h) { return float(h >> 8u) * (1.0 / 16777216.0); }

// Purposes of a tree's random numbers: one constant each keeps them independent.
const uint HASH_TURN = 0x51ed270bu;
const uint HASH_SCALE = 0x2c1b3c6du;
const uint HASH_TINT = 0x297a2d39u;
const uint HASH_MASK = 0x1b56c4e9u;
const uint HASH_DITHER = 0x7feb352du;
const uint HASH_FADE = 0x846ca68bu;
const uint HASH_MESH = 0x3c6ef372u;
const uint HASH_THIN = 0x68e31da4u;
const uint HASH_SPECIES = 0xb5297a4du;
const uint HASH_SWAY = 0x9e6c63d1u;

// How a tree's number of covered samples is rounded, in [0, 1): in frames of one picture by steps, 2^-32.
float tree_dither(uint identity, uint turn) { return unit(hash(identity ^ HASH_DITHER) + turn); }

// Name of a tree in the shadow maps, of 8 bits.
uint caster_name(uint identity) { return hash(identity ^ HASH_DITHER) & 255u; }
