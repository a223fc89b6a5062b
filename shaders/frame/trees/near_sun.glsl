// What shadow maps leave of the sun on meshes and cards. Needs `view`, physics/shadow.glsl and frame/trees/zfield_space.glsl.

layout(binding = 13) uniform sampler2DArray shadow_map;

// What is left of the sun at a place of unit normal n, of which `own` is what its own crown leaves on average. Each tree's shadow counts once:
// where `leaves`, its own is in the map as well, single leaves and all; else the map tells of the other trees alone.
float sun_left(Tree t, Species kind, vec3 world, vec3 n, float own, bool leaves) {
    View v = view.v;
    uint cascade = min(cascade_of(t), MAX_CASCADES - 1u);
    vec2 turn;
    mat4 shadow = cascade_matrix(v, cascade, turn);
    vec3 at = (shadow * vec4(world, 1.0)).xyz;
    float deeper = (shadow * vec4(v.sun_direction, 0.0)).z;
    // Half a texel towards the sun, so that nothing shades itself.
    at.z += 0.5 * v.cascade_texel[cascade] * deeper;
    float reach = 4.0 * kind.scale_to_metres.z * t.scale * deeper;
    vec3 facing = dot(n, v.sun_direction) < 0.0 ? -n : n;
    vec2 gradient = leaves ? plane_gradient(facing, v.cascade_x, v.cascade_y, v.sun_direction) : vec2(0.0);
    float visible = sun_visibility(shadow_map, at, gradient, turn, cascade, leaves ? ON_MESH : caster_name(t.identity), leaves ? 0.0 : reach);
    return (leaves ? 1.0 : own) * (cascade_of(t) < MAX_CASCADES ? visible : 1.0);
}
