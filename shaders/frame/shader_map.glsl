// The forest as a shader of the ground (BN12, section 6 and 7): fractions and radiances of a pixel from the tables, for
// several species mixed by their shares of the density.
//
// With Lambda the density of all trees, s_i the share of species i and L_i its optical thickness were all trees of it,
// crowns of a Poisson distribution give P = exp(-sum s_i L_i), so thicknesses mix linearly; D and 1 - C, which fall about
// exponentially as well, mix as products; and what is seen of the trees is of species i in proportion to s_i L_i.
#include "physics/tables.glsl"
#include "physics/handover.glsl"

layout(binding = 8) uniform sampler3D pair_table;
layout(binding = 9) uniform sampler2DArray view_table;
layout(std430, binding = 10) readonly buffer SpeciesTable { Species items[]; } species;
layout(constant_id = 2) const uint SPECIES_COUNT = 0u;
layout(constant_id = 3) const float TABLE_ANGLES = 16.0;
layout(constant_id = 4) const float TABLE_DENSITIES = 8.0;
layout(constant_id = 5) const bool HAS_SUN = true;

struct ForestPixel {
    float over;          // optical thickness of the trees that the shader-map shows
    float share;         // and its share of that of all trees
    float ground_lit;    // k_g / (k_g + k_g-bar)
    float converged;     // nu of BN12 eq. 24 and 25
    float sky;           // D: sky visibility of level ground
    float expected;      // C: expected coverage by discs
    float seen_coverage; // mean coverage where ground is seen
    float tree_lit;      // k_t / (k_t + k_t-bar)
    vec3 tree_sun, tree_sky; // radiance of the trees
};

ForestPixel shader_map(vec3 v, vec3 n, float distance, Cover c) {
    ForestPixel f = ForestPixel(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, vec3(0.0), vec3(0.0));
    float density = 0.0;
    for (uint k = 0u; k < SPECIES_COUNT; k++) density += species_thickness(c, k) / species.items[k].mean_area;
    if (density <= 0.0) return f;
    float seen = 0.0, joint = 0.0, log_sky = 0.0, log_gap = 0.0;
    for (uint k = 0u; k < SPECIES_COUNT; k++) {
        Species s = species.items[k];
        float share = species_thickness(c, k) / (s.mean_area * density);
        TableAngles a = table_angles(v, view.v.sun_direction, n, s.vertical_scale);
        float x = density * s.mean_area * a.up;
        float at_x = table_density(x, s.max_thickness, TABLE_DENSITIES);
        vec3 at = table_coordinates(a, TABLE_ANGLES);
        vec4 t = table_view(view_table, at.z, at_x, float(k), TABLE_ANGLES, TABLE_DENSITIES);
        vec2 g = table_ground(view_table, table_density(density * s.mean_area, s.max_thickness, TABLE_DENSITIES), float(k),
                              TABLE_ANGLES, TABLE_DENSITIES);
        float l = share * x * a.sec_v * t.x, reach = distance / s.range, part = l * handed_over(reach);
        seen += l;
        f.over += part;
        f.converged += l * converged(reach, view.v.convergence);
        f.seen_coverage += share * t.w;
        log_sky += share * log(max(g.x, 1e-6));
        log_gap += share * log(max(1.0 - g.y, 1e-6));
        // Where nothing is handed over yet no tree is shown, but the mix must stay defined.
        float weight = max(part, 1e-12 * l);
        vec3 leaf = (0.25 * (1.0 + n.z)) * (s.reflectance + s.transmittance) * view.v.sky_radiance;
        f.tree_sky += weight * leaf * (t.y + t.z * s.bark);
        if (HAS_SUN) {
            vec3 p = table_pair(pair_table, at, at_x, float(k), TABLE_ANGLES, TABLE_DENSITIES);
            joint += max(share * x * (a.sec_v + a.sec_l) * p.x, l);
            vec3 full = leaf_phase(v, view.v.sun_direction, s.reflectance, s.transmittance) * view.v.sun_irradiance;
            f.tree_sun += weight * a.sun_facing * full * (p.y + p.z * s.bark);
            f.tree_lit += weight * a.sun_facing * (p.y + p.z);
        }
    }
    float inverse = 1.0 / max(f.over, 1e-12 * seen);
    f.tree_sun *= inverse * hotspot(v, view.v.sun_direction, view.v.hotspot_amplitude, view.v.hotspot_width);
    f.tree_sky *= inverse;
    f.tree_lit *= inverse;
    f.converged /= seen;
    f.ground_lit = exp(seen - joint);
    f.sky = exp(log_sky);
    f.expected = 1.0 - exp(log_gap);
    f.share = f.over / seen;
    return f;
}
