// How a seed's tree sways. Needs physics/hash.glsl and forest/wind.glsl.

// Its shear, in its own axes, as the bits of its word of species; `phases` are those of its quad, `turn` cosine and sine of its rotation.
uint seed_sway(View v, uint phases, Seed s, Species kind, vec2 turn) {
    float gusts = gusts_at(v.wind.xy, v.wind_waves.xyz + place_turns(phases), s.position);
    float height = (kind.centre + kind.scale_to_metres.z) * s.scale;
    vec2 sway = tree_sway(motion_of(v), gusts, height, hash(s.identity ^ HASH_SWAY));
    return pack_sway(vec2(turn.x * sway.x + turn.y * sway.y, turn.x * sway.y - turn.y * sway.x));
}
