// Sky radiance along a pixel's view ray, from a latitude-longitude image: row 0 at the zenith, column 0 at north.
layout(location = 0) in vec2 clip;
layout(std140, binding = 0) uniform ViewBuffer { View v; } view;
layout(binding = 1) uniform sampler2DArray sky;

vec3 sky_radiance() {
    vec3 d = ray_through(camera_of(view.v, vec2(2.0)), clip);
    float east = atan(d.x, d.y) * (0.5 / 3.141592653589793);
    float down = atan(length(d.xy), d.z) * (1.0 / 3.141592653589793);
    return textureLod(sky, vec3(east, clamp(down, 0.001, 0.999), 0.0), 0.0).rgb;
}
