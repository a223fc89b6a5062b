// Forest tables G, T, D, E (BN12, section 6): angles, coordinates and lookups. Twin: src/physics/tables.rs, where the
// parametrisation is derived. Entries are ratios that stay smooth and bounded where G itself does not:
//   G = exp(-x (sec tv + sec tl) W)    lit and visible ground, x = lambda A
//   P = exp(-x sec tv V)               visible ground
// W, V, S = T / lit_of_seen, E and the rest are in textures, linear between the nodes.

const float TABLE_MAX_ANGLE = 1.5358897417550099; // 88 degrees

// Zenith angles of viewer and light and their relative azimuth in scaled space (BN12, eq. 2-4): S scales the vertical
// by k, which makes crowns spheres. Where an angle is 0 there is no azimuth: 0 then.
struct TableAngles {
    float v, l, phi;
    float sec_v, sec_l;
    float length_v, length_l; // of what the vectors have become
};

// Over ground of unit normal n: sheared by what makes it level. Trees stay upright and where they are.
TableAngles table_angles(vec3 v, vec3 l, vec3 n, float k) {
    float level = k / max(n.z, 1e-3);
    vec3 sv = vec3(v.xy, level * dot(v, n)), sl = vec3(l.xy, level * dot(l, n));
    TableAngles a;
    a.length_v = length(sv);
    a.length_l = length(sl);
    // atan2 keeps its precision where acos loses it.
    a.v = atan(length(v.xy), sv.z);
    a.l = atan(length(l.xy), sl.z);
    // The same to the bit where v = l.
    float along = dot(v.xy, l.xy);
    a.phi = atan(abs(v.x * l.y - v.y * l.x), along + (along >= 0.0 ? 1e-9 : -1e-9));
    a.sec_v = 1.0 / max(sv.z / a.length_v, 1e-3);
    a.sec_l = 1.0 / max(sl.z / a.length_l, 1e-3);
    return a;
}

// Coordinate of a viewer's zenith angle in [0, n - 1].
float table_zenith(float v, float n) { return (n - 1.0) * (clamp(v, 0.0, TABLE_MAX_ANGLE) / TABLE_MAX_ANGLE); }

// t of a node whose angle is t2 (3 - t2) / 2 of the room away from the ridge; written so that nothing cancels near it.
float off_ridge_inverse(float part) {
    float s = clamp(part, 0.0, 1.0);
    return sqrt(2.0 * s / (1.5 + sqrt(2.25 - 2.0 * s)));
}

// Grid coordinates, in [0, n - 1], of the azimuth, the light's zenith angle and the viewer's. The second axis counts from
// the viewer's angle on, finely near it, so that the hotspot's ridge v = l is a line of the grid.
vec3 table_coordinates(TableAngles a, float n) {
    float v = clamp(a.v, 0.0, TABLE_MAX_ANGLE), l = clamp(a.l, 0.0, TABLE_MAX_ANGLE), d = l - v;
    float middle = floor(0.5 * (n - 1.0));
    float below = middle * (1.0 - off_ridge_inverse(-d / max(v, 1e-6)));
    float above = middle + (n - 1.0 - middle) * off_ridge_inverse(d / max(TABLE_MAX_ANGLE - v, 1e-6));
    return vec3((n - 1.0) * sqrt(clamp(a.phi * (1.0 / 3.141592653589793), 0.0, 1.0)), d > 0.0 ? above : below,
                table_zenith(a.v, n));
}

// Coordinate of an optical thickness x = lambda A in [0, m - 1].
float table_density(float x, float x_max, float m) { return (m - 1.0) * sqrt(clamp(x / max(x_max, 1e-9), 0.0, 1.0)); }

// (W, S of leaves, S of bark, light transfer), T = S lit_of_seen: trilinear in the angles, linear between two densities.
vec4 table_pair(sampler3D pairs, vec3 at, float density, float species, float n, float m) {
    float j = clamp(floor(density), 0.0, max(m - 2.0, 0.0));
    vec3 size = vec3(textureSize(pairs, 0));
    vec2 uv = (at.xy + 0.5) / size.xy;
    float slice = (species * m + j) * n + at.z + 0.5;
    vec4 a = textureLod(pairs, vec3(uv, slice / size.z), 0.0);
    vec4 b = textureLod(pairs, vec3(uv, (slice + (m > 1.0 ? n : 0.0)) / size.z), 0.0);
    return mix(a, b, density - j);
}

// (V, E of leaves, E of bark, coverage by discs at visible ground), from columns 0 to n - 1.
vec4 table_view(sampler2DArray views, float at_v, float density, float species, float n, float m) {
    return textureLod(views, vec3((at_v + 0.5) / (2.0 * n), (density + 0.5) / m, species), 0.0);
}

// (D_v, C, s, D): sky visibility of the ground that is seen, expected coverage by discs, s of near trees' sky, and sky visibility of all
// ground, from columns n to 2 n - 1.
vec4 table_ground(sampler2DArray views, float at_v, float density, float species, float n, float m) {
    return textureLod(views, vec3((n + at_v + 0.5) / (2.0 * n), (density + 0.5) / m, species), 0.0);
}

// Mean of exp(-x t) over t in [0, 1].
float mean_through(float x) { return x < 1e-2 ? 1.0 - x * (0.5 - x / 6.0) : (1.0 - exp(-x)) / x; }

// What is lit of an even layer among what is seen of it, of the optical paths of the view and of view and light together.
float lit_of_seen(float seen, float joint) { return mean_through(joint) / mean_through(seen); }
