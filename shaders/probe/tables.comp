// Lookups in forest tables at an array of coordinates: tests compare with src/physics/tables.rs.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "physics/tables.glsl"

struct Place {
    vec4 at;      // coordinates of azimuth, light and viewer; of the density
    vec4 species; // its index
};
struct Values {
    vec4 pair;
    vec4 view;
    vec4 ground;
};

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Places { Place items[]; } places;
layout(std430, binding = 1) writeonly buffer Results { Values items[]; } results;
layout(binding = 2) uniform sampler3D pair_table;
layout(binding = 3) uniform sampler2DArray view_table;
layout(push_constant) uniform Push { uint count; };
layout(constant_id = 0) const float TABLE_ANGLES = 16.0;
layout(constant_id = 1) const float TABLE_DENSITIES = 8.0;

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= count) return;
    vec4 at = places.items[k].at;
    float species = places.items[k].species.x;
    results.items[k] = Values(table_pair(pair_table, at.xyz, at.w, species, TABLE_ANGLES, TABLE_DENSITIES),
                              table_view(view_table, at.z, at.w, species, TABLE_ANGLES, TABLE_DENSITIES),
                              table_ground(view_table, at.z, at.w, species, TABLE_ANGLES, TABLE_DENSITIES));
}
