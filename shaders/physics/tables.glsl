// Forest tables G, T, D, E (BN12, section 6): angles, coordinates and lookups. Twin: src/physics/tables.rs, where the
// parametrisation is derived. Entries are ratios that stay smooth and bounded where G itself does not:
//   G = exp(-x (sec tv + sec tl) W)    lit and visible ground, x = lambda A
//   P = exp(-x sec tv V)               visible ground
// W, V, T, E and the rest are in textures, linear between the nodes.

const float TABLE_MAX_ANGLE = 1.5358897417550099; // 88 degrees

// Zenith angles of viewer and light and their relative azimuth about n, all in scaled space (BN12, eq. 2-4): S scales
// the vertical by k, which makes crowns spheres. Where an angle is 0 there is no azimuth: 0 then.
struct TableAngles {
    float v, l, phi;
    float sec_v, sec_l;
    float up;         // u(S^-1 n) . u_z, the factor of the density (BN12, eq. 5)
    float sun_facing; // 1 where the sun is above the slope's horizon, smoothly 0 within two degrees of it
};

TableAngles table_angles(vec3 v, vec3 l, vec3 n, float k) {
    vec3 sv = normalize(vec3(v.xy, k * v.z)), sl = normalize(vec3(l.xy, k * l.z)), sn = normalize(vec3(k * n.xy, n.z));
    float cos_v = dot(sv, sn), cos_l = dot(sl, sn);
    TableAngles a;
    // atan2 keeps its precision where acos loses it.
    a.v = atan(length(cross(sv, sn)), cos_v);
    a.l = atan(length(cross(sl, sn)), cos_l);
    // Of the parts along the ground, which are the same to the bit where v = l.
    vec3 pv = sv - cos_v * sn, pl = sl - cos_l * sn;
    float along = dot(pv, pl);
    a.phi = atan(length(cross(pv, pl)), along + (along >= 0.0 ? 1e-9 : -1e-9));
    a.sec_v = 1.0 / max(cos_v, 1e-3);
    a.sec_l = 1.0 / max(cos_l, 1e-3);
    a.up = sn.z;
    a.sun_facing = smoothstep(0.0, 0.0349, cos_l);
    return a;
}

// Grid coordinates, in [0, n - 1], of the azimuth, the light's zenith angle and the viewer's. The second axis counts from
// the viewer's angle on, finely near it, so that the hotspot's ridge v = l is a line of the grid.
vec3 table_coordinates(TableAngles a, float n) {
    float v = clamp(a.v, 0.0, TABLE_MAX_ANGLE), l = clamp(a.l, 0.0, TABLE_MAX_ANGLE), d = l - v;
    float middle = floor(0.5 * (n - 1.0));
    float below = middle * (1.0 - sqrt(clamp(-d / max(v, 1e-6), 0.0, 1.0)));
    float above = middle + (n - 1.0 - middle) * sqrt(clamp(d / max(TABLE_MAX_ANGLE - v, 1e-6), 0.0, 1.0));
    return vec3((n - 1.0) * sqrt(clamp(a.phi * (1.0 / 3.141592653589793), 0.0, 1.0)), d > 0.0 ? above : below,
                (n - 1.0) * (v / TABLE_MAX_ANGLE));
}

// Coordinate of an optical thickness x = lambda A in [0, m - 1].
float table_density(float x, float x_max, float m) { return (m - 1.0) * sqrt(clamp(x / max(x_max, 1e-9), 0.0, 1.0)); }

// (W, T of leaves, T of bark): trilinear in the angles, linear between two densities.
vec3 table_pair(sampler3D pairs, vec3 at, float density, float species, float n, float m) {
    float j = clamp(floor(density), 0.0, max(m - 2.0, 0.0));
    vec3 size = vec3(textureSize(pairs, 0));
    vec2 uv = (at.xy + 0.5) / size.xy;
    float slice = (species * m + j) * n + at.z + 0.5;
    vec3 a = textureLod(pairs, vec3(uv, slice / size.z), 0.0).xyz;
    vec3 b = textureLod(pairs, vec3(uv, (slice + (m > 1.0 ? n : 0.0)) / size.z), 0.0).xyz;
    return mix(a, b, density - j);
}

// (V, E of leaves, E of bark, coverage by discs at visible ground), from columns 0 to n - 1.
vec4 table_view(sampler2DArray views, float at_v, float density, float species, float n, float m) {
    return textureLod(views, vec3((at_v + 0.5) / (n + 1.0), (density + 0.5) / m, species), 0.0);
}

// (D, C): sky visibility of the ground, and expected coverage by discs, from column n.
vec2 table_ground(sampler2DArray views, float density, float species, float n, float m) {
    return textureLod(views, vec3((n + 0.5) / (n + 1.0), (density + 0.5) / m, species), 0.0).xy;
}
