// The forest as a shader of the ground (BN12, section 6 and 7): fractions and radiances from the tables, for several
// species mixed by their shares of the optical thickness.
//
// With x_i the thickness of species i (density times mean area), crowns of a Poisson distribution give P = exp(-sum x_i sec tv V_i),
// so paths mix linearly; D and 1 - C, which fall about exponentially as well, mix as products; and what is seen of the trees is of
// species i as src/physics/strata.rs has it, where the taller hide the shorter. Trees keep apart, though, and V, W, T, E, D and C of a species are known for forests of it
// alone. In a mix species k is looked up at the thickness of a forest of its own in which as much stands on the path,
// x'_k = sum_j x_j p_j / p_k with p the paths a unit of thickness of crowns by themselves (src/physics/forest.rs, mix), and paths
// grow on from there to x; light, where as much stands above what is seen of it; and coverage, where as much stands at all.
#include "physics/forest.glsl"
#include "physics/handover.glsl"
#include "physics/strata.glsl"
#include "physics/indirect.glsl"

layout(binding = 8) uniform sampler3D pair_table;
layout(binding = 9) uniform sampler2DArray view_table;
layout(std140, binding = 10) uniform SpeciesTable { Species items[MAX_SPECIES]; } species;
layout(binding = 11) uniform samplerBuffer indirect;
layout(constant_id = 6) const bool INDIRECT = false;
layout(constant_id = 7) const int INDIRECT_FIRST = 0; // texel where the first species' begins
layout(constant_id = 2) const uint SPECIES_COUNT = 0u;
layout(constant_id = 3) const float TABLE_ANGLES = 16.0;
layout(constant_id = 4) const float TABLE_DENSITIES = 8.0;
layout(constant_id = 5) const bool PAIR_TABLES = true; // the sun's average light is known, and has a share
layout(constant_id = 8) const bool SHOWS_TREES = true; // else what shows all trees together hides the ground by itself

TableSlope slope_of(vec3 v, vec3 n, uint k) {
    return table_slope(view_table, v, view.v.sun_direction, n, species.items[k].vertical_scale, float(k), TABLE_ANGLES, TABLE_DENSITIES,
                       PAIR_TABLES);
}

// Height above the ground of the middle of a species' crowns, which begin where there is not only bark, and from there to the top; m.
vec2 crowns_of(Species s) {
    float scale = 0.5 * (s.scale_range.x + s.scale_range.y), half_crown = 0.5 * s.scale_to_metres.z;
    return scale * vec2(s.centre + half_crown * (1.0 + s.bare_below), half_crown * (1.0 - s.bare_below));
}

// What is seen along v (unit, to the viewer) of a slope of normal n; thickness is density times mean area of each species.
ForestNode shader_map(vec3 v, vec3 n, float distance, float thickness[MAX_SPECIES]) {
    ForestNode f = ForestNode(vec3(0.0), 0.0, vec3(0.0), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    const bool mixed = SPECIES_COUNT > 1u;
    float total = 0.0;
    vec2 alone[MAX_SPECIES];
    vec3 all = vec3(0.0); // paths of the pattern's trees by themselves and their thickness
    Layer layers[MAX_SPECIES];
    Stratum strata_seen[MAX_SPECIES];
    vec3 through = vec3(0.0); // all layers
    for (uint k = 0u; k < SPECIES_COUNT; k++) {
        // Next to ground without trees there are some: the mix must be defined everywhere.
        thickness[k] += 1e-4;
        total += thickness[k];
        if (!mixed) continue;
        alone[k] = table_alone(pair_table, view_table, slope_of(v, n, k), float(k), TABLE_ANGLES, TABLE_DENSITIES, PAIR_TABLES);
        vec2 path = thickness[k] * alone[k];
        all += species.items[k].listed_density > 0.0 ? vec3(0.0) : vec3(path, thickness[k]);
        vec2 crowns = crowns_of(species.items[k]);
        vec3 paths = vec3(path.x, max(path.y - path.x, 0.0), thickness[k] * species.items[k].sky_path);
        layers[k] = Layer(crowns.x - crowns.y, crowns.x + crowns.y, paths);
        through += layers[k].paths;
    }
    if (mixed) strata(layers, SPECIES_COUNT, strata_seen);
    float weights = 0.0;
    vec3 handed_sun = vec3(0.0);
    for (uint k = 0u; k < SPECIES_COUNT; k++) {
        Species s = species.items[k];
        float x = thickness[k], share = x / total;
        TableKnown known = TableKnown(x, x, x, x, x);
        if (mixed) {
            // Listed trees keep apart from none, but they are themselves there.
            float own = s.listed_density > 0.0 ? x : 0.0;
            float joint = PAIR_TABLES ? all.y / alone[k].y + own : 0.0;
            // Of as much above what is seen of it.
            vec2 above = strata_seen[k].above / max(through.yz * above_one_layer(through.x), 1e-6);
            known = TableKnown(all.x / alone[k].x + own, joint, joint * above.x, through.z / s.sky_path * above.y, all.z + own);
        }
        // The eye above the ground of the place, of the depth of the crowns.
        vec2 depth = crowns_of(s);
        float past = clamp((v.z * distance - (depth.x - depth.y)) / max(2.0 * depth.y, 1e-3), 0.0, 1.0);
        TableForest t = table_forest(pair_table, view_table, slope_of(v, n, k), total, known, s.max_thickness, float(k),
                                     TABLE_ANGLES, TABLE_DENSITIES, PAIR_TABLES, mixed, past);
        float path = share * t.seen, relative = relative_distance(distance, s.range), part = SHOWS_TREES ? path * handed_over(relative) : 0.0;
        f.seen += path;
        f.over += part;
        f.middle += path * depth.x;
        f.half_depth += path * depth.y;
        f.converged += path * converged(relative, abs(view.v.convergence));
        f.seen_coverage += share * t.coverage;
        // As many trees as stand on a metre of the slope.
        float grown = x / min(known.discs, s.max_thickness), steep = x * n.z / min(known.sky * n.z, s.max_thickness);
        f.sky -= steep * log(max(t.ground.x, 1e-6));
        f.gap -= grown * log(max(1.0 - t.ground.y, 1e-6));
        // Where nothing is handed over yet no tree is shown, but the mix must stay defined.
        float weight = max(part, 1e-6 * path);
        if (mixed) weight *= strata_seen[k].share * through.x / layers[k].paths.x;
        weights += weight;
        vec3 leaf = (0.5 * sky_over_slope(n.z, known.sky)) * s.albedo * view.v.sky_radiance;
        f.tree_sky += weight * leaf * (t.sky.x + t.sky.y * s.bark_ratio);
        if (INDIRECT) {
            vec3 l = view.v.sun_direction;
            int base = INDIRECT_FIRST + int(k) * int(TABLE_DENSITIES) * INDIRECT_NODE;
            IndirectAt at = indirect_at(total, texelFetch(indirect, 0).w, int(TABLE_DENSITIES));
            f.tree_sky += weight * indirect_far_sky(indirect, base, at, v.z) * view.v.sky_radiance;
            if (PAIR_TABLES) {
                handed_sun += (weight * sun_facing(l, n)) * indirect_far_sun(indirect, base, at, v.z, l.z, dot(v, l)) * view.v.sun_irradiance;
            }
        }
        if (PAIR_TABLES) {
            f.joint += share * t.joint;
            vec3 lit = turned_reflectance(s.reflectance, s.turning, angle_between(v, view.v.sun_direction));
            vec3 full = leaf_phase(v, view.v.sun_direction, lit, s.transmittance) * view.v.sun_irradiance;
            weight *= sun_facing(view.v.sun_direction, n);
            f.tree_sun += weight * t.transfer * full * (t.sun.x + t.sun.y * s.bark_ratio);
            f.tree_lit += weight * (t.sun.x + t.sun.y);
        }
    }
    float inverse = 1.0 / weights;
    f.tree_sun = inverse * (f.tree_sun * hotspot(v, view.v.sun_direction, view.v.hotspot_amplitude, view.v.hotspot_width) + handed_sun);
    f.tree_sky *= inverse;
    f.tree_lit *= inverse;
    f.converged /= f.seen;
    f.middle /= f.seen;
    f.half_depth /= f.seen;
    inverse = 1.0 / total;
    f.over *= inverse;
    f.seen *= inverse;
    f.joint *= inverse;
    f.sky *= inverse;
    f.gap *= inverse;
    return f;
}
