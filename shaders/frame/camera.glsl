// Rays of the camera: through a pixel, middle + offset from the image's centre times right and down. Their part along the axis is 1.
struct Camera {
    vec3 forward;      // the axis: dot products with it are distances along it
    vec3 middle;       // through the image's centre: the axis, but for frames that are shifted by a part of a pixel
    vec3 right, down;  // of one pixel, at one metre along the axis
    vec3 x, y;         // dot products with a ray whose part along the axis is 1 are pixels from the image's centre
};

Camera camera_of(View v, vec2 size) {
    mat4 m = v.clip_from_world;
    Camera c;
    c.forward = vec3(m[0].w, m[1].w, m[2].w);
    vec3 row_x = vec3(m[0].x, m[1].x, m[2].x), row_y = vec3(m[0].y, m[1].y, m[2].y);
    // Rows of the matrix are unit vectors over the tangents of half the field of view, and the shift along the axis.
    vec3 x = row_x - v.shift.x * c.forward, y = row_y - v.shift.y * c.forward;
    vec3 half_width = x / dot(x, x), half_height = y / dot(y, y);
    c.middle = c.forward - v.shift.x * half_width - v.shift.y * half_height;
    c.right = x * (2.0 / (size.x * dot(x, x)));
    c.down = y * (2.0 / (size.y * dot(y, y)));
    c.x = row_x * (0.5 * size.x);
    c.y = row_y * (0.5 * size.y);
    return c;
}

// The ray through a place of the picture, pixels from its centre.
vec3 ray_through(Camera c, vec2 offset) { return c.middle + offset.x * c.right + offset.y * c.down; }
