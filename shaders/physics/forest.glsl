// What is seen of a forest along a direction, from the tables of its species. Twin: src/physics/forest.rs, where slopes and mixes are
// derived.
#include "physics/tables.glsl"

const float TABLE_MOST_BEYOND = 8.0; // thicknesses of the last node that paths grow on for beyond it

// What is seen of a species' forest.
struct TableForest {
    float seen;     // optical path of the view: visible ground is exp of its negative
    float joint;    // of view and light together, at least that: visible and lit ground
    float coverage; // by discs, at visible ground
    float transfer; // what light transfer makes of the sun's light, on average
    vec2 sun;       // T of leaves and bark
    vec2 sky;       // E of leaves and bark
    vec2 ground;    // D_v and C
};

// What a slope of unit normal n makes of v and l: angles sheared, and level; and the view's path through single crowns over that
// through sheared ones.
struct TableSlope {
    TableAngles s, u;
    float view_path, light_path;
    float up; // vertical part of n
};

float single_path(sampler2DArray views, float from, float to, vec2 lengths, float species, float n, float m) {
    float sheared = table_view(views, table_zenith(from, n), 0.0, species, n, m).x;
    float level = table_view(views, table_zenith(to, n), 0.0, species, n, m).x;
    return (lengths.y * level) / (lengths.x * sheared);
}

TableSlope table_slope(sampler2DArray views, vec3 v, vec3 l, vec3 n, float k, float species, float count, float m, bool lit) {
    TableSlope t;
    t.s = table_angles(v, l, n, k);
    t.u = table_angles(v, l, vec3(0.0, 0.0, 1.0), k);
    t.view_path = single_path(views, t.s.v, t.u.v, vec2(t.s.length_v, t.u.length_v), species, count, m);
    t.light_path = 1.0;
    t.up = n.z;
    if (lit) t.light_path = single_path(views, t.s.l, t.u.l, vec2(t.s.length_l, t.u.length_l), species, count, m);
    return t;
}

// Paths of the view, and of view and light together, a unit of thickness of crowns by themselves.
vec2 table_alone(sampler3D pairs, sampler2DArray views, TableSlope t, float species, float count, float m, bool lit) {
    vec3 at = table_coordinates(t.s, count);
    float seen = t.s.sec_v * t.view_path;
    vec2 path = vec2(seen * table_view(views, at.z, 0.0, species, count, m).x, 0.0);
    if (lit) path.y = (seen + t.s.sec_l * t.light_path) * table_pair(pairs, at, 0.0, species, count, m).x;
    return path;
}

// Thicknesses of forests of one species alone, at which its tables are read: the view's path; that of view and light together;
// what is lit of trees; the sky's light; and coverage by discs. All are x where the species stands alone.
struct TableKnown {
    float seen, joint, light, sky, discs;
};

// How far beyond the last node a thickness is, in its own. Paths grow on there as they did up to it, and the sky's light falls on.
float table_beyond(float known, float x_max) { return clamp(known / x_max - 1.0, 0.0, TABLE_MOST_BEYOND); }
float grown_path(float full, float alone, float beyond) { return full + beyond * max(full - alone, 0.0); }

// Trees of optical thickness x (density times area). The tables are of level ground, which a shear makes of a slope. It leaves how
// trees stand to each other, and changes crowns: what one crown by itself is to v and l, at density 0, is put in place of what the
// shear makes of it, and so do the paths through the crowns before it. Nothing changes on level ground.
// `past`: through what part of the crowns' depth the ground is seen, 1 from above them.
TableForest table_forest(sampler3D pairs, sampler2DArray views, TableSlope t, float x, TableKnown known, float x_max,
                         float species, float count, float m, bool lit, bool mixed, float past) {
    float at_sky = table_density(known.sky, x_max, m), at_seen = table_density(known.seen, x_max, m);
    float at_discs = table_density(known.discs, x_max, m);
    vec3 at_s = table_coordinates(t.s, count), at_u = table_coordinates(t.u, count);
    vec4 full = table_view(views, at_s.z, at_sky, species, count, m);
    vec4 vs = table_view(views, at_s.z, 0.0, species, count, m), vu = table_view(views, at_u.z, 0.0, species, count, m);
    float path = mixed ? table_view(views, at_s.z, at_seen, species, count, m).x : full.x;
    float coverage = mixed ? table_view(views, at_s.z, at_discs, species, count, m).w : full.w;
    TableForest f;
    f.seen = x * t.s.sec_v * grown_path(path, vs.x, table_beyond(known.seen, x_max)) * t.view_path;
    f.joint = f.seen;
    // Of as many trees as stand on a metre of the slope: about its normal that is level ground.
    float at_steep = table_density(known.sky * t.up, x_max, m);
    // Of ground that the viewer sees past the crowns before it: where he stands among or under them there is less to see it past, and what he
    // sees is nearer to all ground.
    vec4 steep = table_ground(views, at_s.z, at_steep, species, count, m);
    f.ground.x = exp(mix(log(max(steep.w, 1e-6)), log(max(steep.x, 1e-6)), past));
    f.ground.y = table_ground(views, at_s.z, at_discs, species, count, m).y;
    f.coverage = mix(f.ground.y, coverage, past);
    f.transfer = 1.0;
    f.sun = vec2(0.0);
    f.sky = full.yz * ((vu.y + vu.z) / max(vs.y + vs.z, 1e-3));
    float dimmer = clamp((full.y + full.z) / max(vs.y + vs.z, 1e-3), 1e-3, 1.0);
    f.sky *= pow(dimmer, table_beyond(known.sky, x_max));
    if (lit) {
        vec4 p = table_pair(pairs, at_s, table_density(known.joint, x_max, m), species, count, m);
        vec4 ps = table_pair(pairs, at_s, 0.0, species, count, m), pu = table_pair(pairs, at_u, 0.0, species, count, m);
        vec4 q = mixed ? table_pair(pairs, at_s, table_density(known.light, x_max, m), species, count, m) : p;
        float w = grown_path(p.x, ps.x, table_beyond(known.joint, x_max));
        f.joint = max(x * (t.s.sec_v * t.view_path + t.s.sec_l * t.light_path) * w, f.seen);
        float above = mixed ? known.light / known.joint : 1.0;
        float change = lit_of_seen(f.seen * above, f.joint * above) * (pu.y + pu.z) / max(ps.y + ps.z, 1e-3);
        f.sun = q.yz * min(change, 1.0 / max(q.y + q.z, 1e-6));
        f.transfer = q.w * (pu.w / max(ps.w, 1e-3));
    }
    return f;
}
