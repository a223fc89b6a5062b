// Sky radiance along a pixel's view ray, from a latitude-longitude image: row 0 at the zenith, column 0 at north.
layout(location = 0) in vec2 clip;
layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 1) uniform sampler2DArray sky;

vec3 sky_radiance() {
    // Rows of the clip matrix are right / tan, -up / tan, and forward: combine them into the ray.
    mat4 m = view.v.clip_from_world;
    vec3 x = vec3(m[0].x, m[1].x, m[2].x), y = vec3(m[0].y, m[1].y, m[2].y), f = vec3(m[0].w, m[1].w, m[2].w);
    vec3 d = f + clip.x * x / dot(x, x) + clip.y * y / dot(y, y);
    float east = atan(d.x, d.y) * (0.5 / 3.141592653589793);
    float down = atan(length(d.xy), d.z) * (1.0 / 3.141592653589793);
    return textureLod(sky, vec3(east, clamp(down, 0.001, 0.999), 0.0), 0.0).rgb;
}
