// Bilinear samples of views from four texels each: on drivers that filter in software less than half a sampler's price. What lies
// outside a view is transparent, as with a sampler that clamps to a transparent border.

vec4 view_sample(sampler2DArray views, vec2 at, float layer, float mip) {
    int level = int(mip);
    // Not textureSize(views, level): llvmpipe takes one invocation's level for all.
    ivec2 size = max(textureSize(views, 0).xy >> level, 1);
    vec2 texel = at * vec2(size) - 0.5, low = floor(texel), f = texel - low;
    ivec2 a = ivec2(low), b = a + 1, last = size - 1;
    vec2 near = mix(vec2(0.0), 1.0 - f, vec2(greaterThanEqual(a, ivec2(0))) * vec2(lessThanEqual(a, last)));
    vec2 far = mix(vec2(0.0), f, vec2(greaterThanEqual(b, ivec2(0))) * vec2(lessThanEqual(b, last)));
    ivec2 i = clamp(a, ivec2(0), last), j = clamp(b, ivec2(0), last);
    int k = int(layer);
    vec4 south = near.x * texelFetch(views, ivec3(i, k), level) + far.x * texelFetch(views, ivec3(j.x, i.y, k), level);
    vec4 north = near.x * texelFetch(views, ivec3(i.x, j.y, k), level) + far.x * texelFetch(views, ivec3(j, k), level);
    return near.y * south + far.y * north;
}

#define VIEW_SAMPLE view_sample
