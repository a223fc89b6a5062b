// What samples see of the surfaces that the graphics pipeline draws, ground and meshes: which, and how deep.
#include "frame/trees/near_seen.glsl"

#ifdef SINGLE
layout(binding = 10) uniform sampler2DArray depth;
layout(binding = 11) uniform usampler2DArray quads_seen;
#else
layout(binding = 10) uniform sampler2DMSArray depth;
layout(binding = 11) uniform usampler2DMSArray quads_seen;
#endif

// Of one sample a pixel there is level 0 alone.
float surface_depth(ivec2 pixel, int k) { return texelFetch(depth, ivec3(pixel, 0), k).r; }
uint surface_seen(ivec2 pixel, int k) { return texelFetch(quads_seen, ivec3(pixel, 0), k).r; }
