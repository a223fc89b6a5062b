// What the wind does to trees. Twin: src/physics/wind.rs, which has the equations.

const float MOST_SHEAR = 0.12;      // metres sideways per metre of height
const float PERIOD = 64.0;          // in which everything but gusts begins anew, s
const float WIND_TURN = 6.283185307179586;

// The wind at a time, as View has it.
struct Motion {
    vec2 toward;    // unit vector to where it blows
    float gust;     // amplitudes of the shear: by gusts, of a tree's own
    float own;
    float branch;   // of branches
    float leaf;     // of leaves, rad
    uint clock;     // part of PERIOD that has passed, 2^-32
};

float turn_sine(float turns) { return sin(WIND_TURN * (turns - floor(turns + 0.5))); }

// Turns after `count` periods in PERIOD: products wrap around as turns do.
float clock_turns(uint clock, uint count) { return float(int(clock * count)) * (1.0 / 4294967296.0); }

// Gusts so far from a place with these phases of the waves, turns; x is east and north, m.
float gusts_at(vec2 toward, vec3 phases, vec2 x) {
    float along = dot(toward, x), aside = toward.x * x.y - toward.y * x.x;
    return 0.5 * turn_sine(phases.x + along * (1.0 / 230.0)) +
           0.3 * turn_sine(phases.y + (0.9135454576426009 * along + 0.40673664307580015 * aside) * (1.0 / 97.0)) +
           0.2 * turn_sine(phases.z + (0.838670567945424 * along - 0.5446390350150271 * aside) * (1.0 / 41.0));
}

// The phases that a place of ten bits each adds.
vec3 place_turns(uint phases) { return vec3(uvec3(phases, phases >> 10u, phases >> 20u) & 1023u) * (1.0 / 1024.0); }

// Shear of a tree of a height in metres, east and north.
vec2 tree_sway(Motion m, float gusts, float height, uint hash) {
    float frequency = min(0.0766 + 3.1219 * 1.5 / max(height, 1e-3), 4.0) * (0.85 + 0.3 * (float(hash & 255u) * (1.0 / 256.0)));
    uint count = uint(floor(frequency * PERIOD + 0.5));
    float along = m.gust * gusts + 0.9 * m.own * turn_sine(clock_turns(m.clock, count) + float(hash >> 8u & 1023u) * (1.0 / 1024.0));
    float aside = 0.43 * m.own * turn_sine(clock_turns(m.clock, count + 1u + (hash >> 30u)) + float(hash >> 18u & 4095u) * (1.0 / 4096.0));
    return along * m.toward + aside * vec2(-m.toward.y, m.toward.x);
}

// How far a branch moves at a place from the middle of its model's box, m.
vec3 branch_sway(Motion m, vec3 p, uint name) {
    float r = length(p.xy), own = float(name) * (1.0 / 256.0);
    uint count = uint(floor(PERIOD * (0.8 + 0.8 * own) + 0.5));
    float turns = clock_turns(m.clock, count) + 5.0 * own + dot(p, vec3(0.13, 0.09, 0.07)), swing = m.branch * r / (r + 1.0);
    float aside = 0.8 * swing * turn_sine(turns), up = 0.6 * swing * turn_sine(1.0 / 3.0 + turns - 0.22 * p.x);
    return vec3(-p.y * aside, p.x * aside, r * up);
}

// Angle of a leaf, rad.
float leaf_flutter(Motion m, uint hash) {
    return m.leaf * turn_sine(clock_turns(m.clock, 128u + (hash & 255u)) + float(hash >> 8u) * (1.0 / 16777216.0));
}

// A vector turned about a unit axis.
vec3 turned_about(vec3 v, vec3 axis, float angle) {
    float cosine = cos(angle);
    return cosine * v + sin(angle) * cross(axis, v) + ((1.0 - cosine) * dot(axis, v)) * axis;
}

// The axis of a leaf, of two signed bytes: an octahedron unfolded (Meyer et al. 2010).
vec3 card_axis(uint bits) {
    vec2 e = vec2(ivec2(int(bits << 24u), int(bits << 16u)) >> 24) * (1.0 / 127.0);
    vec3 v = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (v.z < 0.0) v.xy = (1.0 - abs(v.yx)) * vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0);
    return normalize(v);
}

// A shear as 28 bits, from the fourth of a word on.
uint pack_sway(vec2 s) {
    ivec2 steps = ivec2(floor(clamp(s, -MOST_SHEAR, MOST_SHEAR) * (8191.0 / MOST_SHEAR) + 0.5)) & 0x3fff;
    return uint(steps.x) << 4u | uint(steps.y) << 18u;
}
vec2 unpack_sway(uint word) { return vec2(ivec2(int(word << 14u), int(word)) >> 18) * (MOST_SHEAR / 8191.0); }
