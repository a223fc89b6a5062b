// A disc of a tree's mean horizontal area, into the coverage tile of its quad or a neighbour's.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_ARB_shader_viewport_layer_array : require
#include "interface.glsl"

layout(std430, binding = 0) readonly buffer Seeds { Seed items[]; } seeds;
layout(std430, binding = 1) readonly buffer SpeciesTable { Species items[]; } species;
layout(push_constant) uniform Push { CoverageTile tile; };
layout(constant_id = 0) const float SIDE = 256.0;

layout(location = 0) out vec2 from_centre; // texels
layout(location = 1) flat out float radius;

void main() {
    Seed s = seeds.items[gl_VertexIndex >> 2];
    // Texel centres of the border lie on the quad's edges, so that neighbouring tiles agree there.
    float texels_per_metre = (SIDE - 1.0) / tile.side;
    radius = species.items[s.species_density & 0xffffu].crown_radius * s.scale * texels_per_metre;
    vec2 corner = vec2((gl_VertexIndex & 1) == 0 ? -1.0 : 1.0, (gl_VertexIndex & 2) == 0 ? -1.0 : 1.0);
    from_centre = corner * (radius + 1.0);
    vec2 at = (tile.offset + s.position) * texels_per_metre + 0.5 + from_centre;
    gl_Position = vec4(at * (2.0 / SIDE) - 1.0, 0.0, 1.0);
    gl_Layer = int(tile.layer);
}
