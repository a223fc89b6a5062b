// Which trees cast into what is drawn of a block of a shadow cascade. `precise` and a fixed order of operations let
// src/forest/casters.rs agree to the bit. All is world-fixed: where the camera is changes nothing.

float caster_dot(vec3 a, vec3 b) {
    precise float d = a.x * b.x;
    d = d + a.y * b.y;
    d = d + a.z * b.z;
    return d;
}

// Centre of a tree's box in the block.
vec3 caster_place(ShadowBlock b, CasterQuad q, Seed s, Species kind) {
    precise float height = (s.ground - b.ground) + kind.centre * s.scale;
    vec3 within = vec3(s.position, height);
    precise vec3 place = q.corner + vec3(caster_dot(b.x, within), caster_dot(b.y, within), caster_dot(b.z, within));
    return place;
}

// The pages of the block that what lies around a place may touch, of a species with views of so many texels: first and last, none if there is a last before
// a first.
ivec4 caster_pages(ShadowBlock b, vec3 place, float radius, float resolution) {
    // Quads are half a texel of their view larger, and on a slant that is sqrt 2 of a half. Of the mip in use that is up to two texels of the map; where the map is
    // finer than the finest mip, half of 2 radius / resolution.
    precise float around = radius * b.texels_per_metre;
    precise float reach = around + max(2.0, 1.5 * around / resolution);
    precise vec4 pages = vec4(place.xy - reach, place.xy + reach) * b.pages_per_texel;
    // Clamped before they are integers: far away there are more than those hold.
    pages = clamp(floor(pages), vec4(vec2(b.first) - 1.0, vec2(b.first) - 1.0), vec4(b.last, b.last));
    ivec4 all = ivec4(pages);
    return ivec4(max(all.xy, b.first), min(all.zw, b.last - 1));
}
