// What a pixel shows: its radiance, or with LAYERS defined the parts of it, each the mean over its samples.

#ifdef LAYERS
layout(binding = 20, rgba16f) uniform image2DArray sun_part;
layout(binding = 21, rgba16f) uniform image2DArray sky_part;  // w: share that is trees
layout(binding = 22, r32ui) uniform writeonly uimage2DArray species_at; // of the first sample, counted from 1; 0: none
layout(binding = 23, rgba16f) uniform image2DArray fractions;
layout(binding = 24, r32f) uniform writeonly image2DArray depth_at; // of the first sample, as a depth buffer has it

struct Shown {
    vec4 sun, sky, fractions;
};

Shown shown_nothing() { return Shown(vec4(0.0), vec4(0.0), vec4(0.0)); }
Shown shown_sky(vec3 sky) { return Shown(vec4(0.0), vec4(sky, 0.0), vec4(0.0)); }
Shown scaled(Shown a, float s) { return Shown(s * a.sun, s * a.sky, s * a.fractions); }
Shown sum(Shown a, Shown b) { return Shown(a.sun + b.sun, a.sky + b.sky, a.fractions + b.fractions); }
uvec2 picture_size() { return uvec2(imageSize(sun_part).xy); }

Shown load_pixel(ivec2 pixel) {
    ivec3 at = ivec3(pixel, 0);
    return Shown(imageLoad(sun_part, at), imageLoad(sky_part, at), imageLoad(fractions, at));
}

void store_pixel(ivec2 pixel, Shown s) {
    ivec3 at = ivec3(pixel, 0);
    imageStore(sun_part, at, s.sun);
    imageStore(sky_part, at, s.sky);
    imageStore(fractions, at, s.fractions);
}

// What the first sample sees: a species, counted from 1, or none, and how deep.
void store_first(ivec2 pixel, uint species, float depth) {
    imageStore(species_at, ivec3(pixel, 0), uvec4(species, 0u, 0u, 0u));
    imageStore(depth_at, ivec3(pixel, 0), vec4(depth, 0.0, 0.0, 0.0));
}
#else
layout(binding = 20, rgba16f) uniform image2DArray radiance;

struct Shown {
    vec4 radiance;
};

Shown shown_nothing() { return Shown(vec4(0.0)); }
Shown shown_sky(vec3 sky) { return Shown(vec4(sky, 0.0)); }
Shown scaled(Shown a, float s) { return Shown(s * a.radiance); }
Shown sum(Shown a, Shown b) { return Shown(a.radiance + b.radiance); }
uvec2 picture_size() { return uvec2(imageSize(radiance).xy); }
Shown load_pixel(ivec2 pixel) { return Shown(imageLoad(radiance, ivec3(pixel, 0))); }
void store_pixel(ivec2 pixel, Shown s) { imageStore(radiance, ivec3(pixel, 0), s.radiance); }
void store_first(ivec2 pixel, uint species, float depth) {}
#endif
