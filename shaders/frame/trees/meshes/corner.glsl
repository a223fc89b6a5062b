// Corners of a model's triangles: the place from the middle of the tree's box, m, and the texture coordinates, 16 bits each.

const float UV_STEPS = 2048.0; // a texture

vec3 corner_place(uvec4 corner) { return uintBitsToFloat(corner.xyz); }
vec2 corner_uv(uvec4 corner) { return vec2(corner.w & 0xffffu, corner.w >> 16u) * (1.0 / UV_STEPS); }

// A place of a model in the world, from the camera.
vec3 world_from_model(Tree t, vec3 place) { return t.centre + rotated(t.turn, place * t.scale); }
