// Rays of the camera: through a pixel, forward + offset from the image's centre times right and down.
struct Camera {
    vec3 forward;
    vec3 right, down;  // of one pixel, at one metre along the axis
    vec3 x, y;         // dot products with a ray whose part along the axis is 1 are pixels from the image's centre
};

Camera camera_of(View v, vec2 size) {
    mat4 m = v.clip_from_world;
    Camera c;
    c.forward = vec3(m[0].w, m[1].w, m[2].w);
    vec3 x = vec3(m[0].x, m[1].x, m[2].x), y = vec3(m[0].y, m[1].y, m[2].y);
    // Rows of the matrix are unit vectors over the tangents of half the field of view.
    c.right = x * (2.0 / (size.x * dot(x, x)));
    c.down = y * (2.0 / (size.y * dot(y, y)));
    c.x = x * (0.5 * size.x);
    c.y = y * (0.5 * size.y);
    return c;
}
