// Coverage to expect from the local density, from the sum of density times mean area over the species; no disc yet.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/terrain.glsl"

layout(std430, binding = 0) readonly buffer Quads { SeedQuad items[]; } quads;
layout(std430, binding = 1) readonly buffer SpeciesTable { Species items[]; } species;
layout(binding = 2) uniform sampler2DArray heights;
layout(binding = 3) uniform sampler2DArray densities;
layout(push_constant) uniform Push { SeedParameters p; CoverageTile tile; };
layout(constant_id = 0) const float SIDE = 256.0;
layout(constant_id = 1) const uint SPECIES_COUNT = 1u;
layout(location = 0) out vec4 coverage;

#include "forest/density.glsl"

void main() {
    SeedQuad q = quads.items[p.first_quad];
    vec2 within = (gl_FragCoord.xy - 0.5) * (p.quad_side / (SIDE - 1.0));
    vec2 world = vec2(q.texel) * p.cell_size + q.texel_offset * p.cell_size + within;
    vec3 g = vec3(0.0);
    if (p.has_heights != 0u) g = height_and_slope(heights, q.texel, q.texel_offset + within / p.cell_size);
    float slope = length(g.yz) / p.cell_size, sum = 0.0;
    for (uint k = 0u; k < SPECIES_COUNT; k++) {
        Species s = species.items[k];
        // Mean of the squared random scale: (a2 + ab + b2) / 3.
        vec2 r = s.scale_range;
        float area = 3.141592653589793 * s.crown_radius * s.crown_radius * (r.x * r.x + r.x * r.y + r.y * r.y) / 3.0;
        sum += area * local_density(s, world, p.extent, g.x, slope);
    }
    // Discs overlap: at random they cover 1 - exp(-Lambda A), not Lambda A.
    coverage = vec4(0.0, 1.0 - exp(-sum), 0.0, 1.0);
}
