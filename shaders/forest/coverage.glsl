// Discs on texels, and the sums that make their union. Twin in tests/gpu/coverage.rs.

// A texel that a disc covers whole stays open to 2^-12: less than half floats tell from none. Sums are of 2^-13: finer
// than half floats, and 60,000 discs over one texel still fit.
const float SUM_SCALE = 8192.0;
const float LEAST_OPEN = 1.0 / 4096.0;
// Discs of a smaller radius, in texels, keep their area exactly, shared between four texels.
const float SMALL_DISC = 0.6;

// How far from its centre, along either axis, a disc reaches centres of texels.
float disc_reach(float radius) { return radius < SMALL_DISC ? 1.0 : radius + 0.5; }

// Share of a texel that a disc covers, by the place of the texel's centre from the disc's. An edge a texel wide, about
// a radius R = sqrt(r^2 - 1/12) for which the integral over the plane is the disc's area: pi (R^2 + 1/12).
float disc_share(vec2 from_centre, float radius) {
    vec2 tent = max(1.0 - abs(from_centre), 0.0);
    float edge = clamp(sqrt(max(radius * radius - 1.0 / 12.0, 0.0)) + 0.5 - length(from_centre), 0.0, 1.0);
    return radius < SMALL_DISC ? 3.141592653589793 * radius * radius * tent.x * tent.y : edge;
}

// -ln(1 - share) in steps of the sum.
uint open_sum(float share) { return uint(-log(clamp(1.0 - share, LEAST_OPEN, 1.0)) * SUM_SCALE + 0.5); }

// Coverage from a sum: 0 exactly where there is none.
float covered(uint sum) { return sum == 0u ? 0.0 : 1.0 - exp(-float(sum) / SUM_SCALE); }
