// Which ground a far forest that is seen, or that shades, stands on. Twin: src/physics/lift.rs, where the forms are derived.

const float LIFT_MOST = 4.0; // heights at which a sight line's path through the crowns is read, at most

// How many are, on a way of so many texels, and which: from -1 at the lower end of crowns to 1 at their upper.
uint lift_count(float texels) { return uint(clamp(ceil(texels), 1.0, LIFT_MOST)); }
float lift_height(uint k, uint count) { return (2.0 * float(k) + 1.0) / float(count) - 1.0; }

// From a point of ground of unit normal n along the unit vector w, until it is as high above the ground: m on the map. No more grazing
// than a hundredth.
vec2 lifted(vec3 w, vec3 n, float height) { return w.xy * (height * n.z / max(dot(n, w), 0.01)); }
