// Real spherical harmonics at a unit vector, l^2 + l + m. Twin: src/physics/harmonics.rs.

// Bands l = 0, 1, 2: what lights and textures of transfer have.
void harmonics(vec3 w, out float y[9]) {
    y[0] = 0.28209479;
    y[1] = 0.48860251 * w.y;
    y[2] = 0.48860251 * w.z;
    y[3] = 0.48860251 * w.x;
    y[4] = 1.09254843 * w.x * w.y;
    y[5] = 1.09254843 * w.y * w.z;
    y[6] = 0.31539157 * (3.0 * w.z * w.z - 1.0);
    y[7] = 1.09254843 * w.x * w.z;
    y[8] = 0.54627422 * (w.x * w.x - w.y * w.y);
}

// Band l = 3.
void harmonics_third(vec3 w, out float y[7]) {
    vec3 q = w * w;
    float c = 5.0 * q.z;
    y[0] = 0.59004359 * w.y * (3.0 * q.x - q.y);
    y[1] = 2.89061144 * w.x * w.y * w.z;
    y[2] = 0.45704580 * w.y * (c - 1.0);
    y[3] = 0.37317633 * w.z * (c - 3.0);
    y[4] = 0.45704580 * w.x * (c - 1.0);
    y[5] = 1.44530572 * w.z * (q.x - q.y);
    y[6] = 0.59004359 * w.x * (q.x - 3.0 * q.y);
}
