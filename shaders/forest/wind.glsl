// The wind in a frame: of a scene without any nothing of it is asked.
#include "physics/wind.glsl"

layout(constant_id = 20) const bool WIND = false;

Motion motion_of(View v) { return Motion(v.wind.xy, v.wind.z, v.wind.w, v.wind_here.w, v.wind_waves.w, v.wind_clock); }

// The row of a tree's species, in whose word its sway is as well.
uint species_row(uint word) { return word & TREE_SPECIES; }

// A place or direction of a tree at rest, in its own axes, m, from the middle of its box: where it is while the tree sways, and back. The sway
// is in the word of the tree's species.
vec3 swayed(uint word, vec3 m) {
    if (WIND) m.xy += unpack_sway(word) * m.z;
    return m;
}
vec3 unswayed(uint word, vec3 m) {
    if (WIND) m.xy -= unpack_sway(word) * m.z;
    return m;
}
