// Surfaces along rays through a z-field: tests compare with src/physics/zfield.rs. The search is that of the frame.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "physics/views.glsl"
#include "physics/zfield.glsl"

struct Ray {
    vec4 origin; // w: mip
    vec4 to;     // w: iterations
};

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Rays { Ray items[]; } rays;
layout(std430, binding = 1) writeonly buffer Results { vec4 items[]; } results;
layout(std430, binding = 2) readonly buffer Bases { ViewBasis items[]; } bases;
layout(binding = 3) uniform sampler2DArray views;
layout(push_constant) uniform Push { uint count; int rings; };

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= count) return;
    Ray ray = rays.items[k];
    uvec3 layers;
    vec3 weights;
    bool below = ray.to.z < 0.0;
    view_lookup(below ? -ray.to.xyz : ray.to.xyz, rings, layers, weights);
    vec3 p[3], d[3];
    for (int i = 0; i < 3; i++) {
        ViewBasis b = bases.items[layers[i]];
        p[i] = vec3(dot(b.u.xyz, ray.origin.xyz), dot(b.v.xyz, ray.origin.xyz), dot(b.depth.xyz, ray.origin.xyz));
        d[i] = vec3(dot(b.u.xyz, ray.to.xyz), dot(b.v.xyz, ray.to.xyz), dot(b.depth.xyz, ray.to.xyz));
    }
    // Filtered where texels are magnified, as in frame/trees/zfield.vert.
    uint before = uint(ray.to.w) - 1u;
    bool magnified = ray.origin.w < 0.5;
    Surface at = zfield_search(views, p, d, vec3(layers), weights, ray.origin.w, magnified ? 0u : before,
                               magnified ? before : 0u, below);
    results.items[k] = vec4(at.s, at.opacity, at.occlusion, 0.0);
}
