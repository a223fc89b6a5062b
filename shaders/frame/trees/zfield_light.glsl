// Light on what is seen of a z-field tree (BN12, section 5). Needs physics/{light,correction,zfield,shadow,transfer,indirect}.glsl.

// What is the same all over a tree.
struct TreeLight {
    vec3 sun;           // radiance of a lit leaf at height 0
    float sun_change;   // of that with the height, over it
    vec3 sky;           // radiance of a leaf under the whole sky
    vec3 mean_sun;      // average radiance from the sun, times nu of BN12 eq. 22
    vec3 mean_sky;      // average radiance from the sky, times nu
    float mean_lit;     // average lit fraction, times nu
    float own;          // 1 - nu: weight of the tree's own light
    vec2 lit;           // correction of the share that is lit, as a line in the height
    vec3 bark_ratio;    // reflectance of bark over that of leaves
    float bare_below;   // height under which there is only bark
    float half_height;  // metres from the centre to the top
    float hole;         // 1 / squared radius of the hole around it, 1/m2
    float leaf;         // c of the self-shadow times the root of the phase angle
    float extinction;   // tau of the self-shadow times the phase angle, 1/m
    vec3 toward;        // the sun, in the tree's own axes
    float transfer;     // strength of light transfer
    uint cascade;       // for shadow lookups; MAX_CASCADES: none
    uint name;          // in the shadow maps
    uvec4 handed;       // light that met more than one surface: the sun's, the sky's
    uvec2 open;         // what there is of the sky's over what the z-field knows
};

// The ray from a seen point to the sun.
struct LightRay {
    vec3 from[3];       // the point, in three views around the light's direction
    vec3 metre[3];      // one metre towards the sun, in the same
    vec3 layers;
    vec3 weights;
    vec3 entry;         // the point in its cascade
    float deeper;       // change of the depth there a metre towards the sun
    vec2 turn;          // texel of the shadow map where the cascade's first one is
};

// What is asked of the light.
struct LightQuality {
    bool sun;           // it shines
    bool indirect;      // light of the forest counts
    int iterations;     // to where its light enters the crown
    uint bands;         // of light transfer
    float coarser;      // levels by which its texels are larger than the views'
};

struct TreeParts {
    vec3 sun, sky;      // parts of the radiance
    float lit;          // fraction of the sun that arrives
};

// Where its light enters the crown: metres from the point to there.
float light_entry(sampler2DArray views, LightRay ray, float mip, int iterations, bool magnified) {
    vec3 lp[3], ld[3];
    for (int i = 0; i < 3; i++) {
        lp[i] = ray.from[i];
        ld[i] = ray.metre[i];
    }
    vec3 lw = ray.weights;
    // Start on the plane through the centre across the light.
    float metres = -dot(lw, vec3(lp[0].z, lp[1].z, lp[2].z)) / dot(lw, vec3(ld[0].z, ld[1].z, ld[2].z));
    vec3 inverse_light = 1.0 / vec3(ld[0].z, ld[1].z, ld[2].z);
    // Unfiltered where a texel is no larger than a pixel.
    int filtered = magnified ? iterations : 0;
    for (int k = 0; k < filtered; k++) {
        metres = zfield_fetch(views, lp, ld, inverse_light, ray.layers, lw, mip, metres, false, k > 0).s;
    }
    for (int k = filtered; k < iterations; k++) {
        metres = zfield_estimate(views, lp, ld, inverse_light, ray.layers, lw, mip, metres, false);
    }
    return max(metres, 0.0);
}

// Light at the surface that a view ray p + s d meets at s; `height` is in scaled tree space.
TreeParts tree_light(sampler2DArray views, sampler2DArray shadow_map, sampler2DArray transfer_1, sampler2DArray transfer_2,
                     TreeLight t, Surface at, vec3 p[3], vec3 d[3], vec3 layers, bool below, float mip, bool magnified, float s,
                     float height, LightRay ray, LightQuality quality) {
    TreeParts light = TreeParts(t.mean_sun, t.mean_sky, quality.sun ? t.mean_lit : 0.0);
    // Under the crown there is only bark; half a metre or so of transition.
    vec3 surface = mix(t.bark_ratio, vec3(1.0), smoothstep(t.bare_below - 0.05, t.bare_below + 0.05, height)), colour = t.own * surface;
    if (quality.sun) {
        float metres = quality.iterations > 0 ? light_entry(views, ray, mip, quality.iterations, magnified) : 0.0;
        float through = self_shadow(t.leaf, t.extinction, metres);
        vec3 entry = ray.entry;
        entry.z += metres * ray.deeper;
        float visible = sun_visibility(shadow_map, entry, vec2(0.0), ray.turn, min(t.cascade, MAX_CASCADES - 1u), t.name,
                                       4.0 * t.half_height * ray.deeper);
        through *= t.cascade < MAX_CASCADES ? visible : 1.0;
        light.lit += t.own * min(through * correction_at(t.lit, height), 1.0);
        float reached = through * correction_at(vec2(1.0, t.sun_change), height);
        // From below, views show the other side.
        if (quality.bands > 0u && !below) {
            vec3 shares = at.shares / max(at.shares.x + at.shares.y + at.shares.z, 1e-6);
            float coarser = max(mip - quality.coarser, 0.0);
            float x = transfer_fetch(transfer_1, transfer_first(t.toward), p, d, layers, shares, coarser, s);
            if (quality.bands > 1u) x += transfer_fetch(transfer_2, transfer_second(t.toward), p, d, layers, shares, coarser, s);
            reached *= max(1.0 + t.transfer * x, 0.0);
        }
        light.sun += t.sun * colour * reached;
    }
    // Depth under the top of the canopy, for the sky through the hole around the tree, where what others leave was not measured.
    float below_top = max(1.0 - height, 0.0) * t.half_height;
    float others = quality.indirect ? open_at(unpack_open(t.open), height) : 1.0 / (1.0 + below_top * below_top * t.hole);
    light.sky += t.sky * colour * (at.occlusion * others);
    if (quality.indirect) {
        light.sun += handed_at(t.handed.xy, height) * surface;
        light.sky += handed_at(t.handed.zw, height) * surface;
    }
    return light;
}
