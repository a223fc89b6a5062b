// A triangle over the whole image for each tree of a set.
#version 450

layout(location = 0) flat out uint tree;

void main() {
    tree = uint(gl_InstanceIndex);
    gl_Position = vec4(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0, 0.5, 1.0);
}
