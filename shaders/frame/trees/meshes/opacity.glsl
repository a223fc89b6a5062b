// What of a pixel a mask leaves. Its texels are opacities, with the material's cutoff at a half; of coarser levels, shares that are no
// hole. Where a texel is larger than a pixel the edge stays a pixel wide. `wider` is log2 of how much nearer pixels are than they are wide.
float mask_opacity(sampler2DArray masks, vec2 uv, vec2 across, vec2 down, uint layer, float wider) {
    float side = float(textureSize(masks, 0).x);
    float level = 0.5 * log2(max(max(dot(across, across), dot(down, down)), 1e-12)) + log2(side) + wider;
    float here = textureLod(masks, vec3(uv, float(layer)), max(floor(level + 0.5), 0.0)).r;
    return layer == NO_PAGE ? 1.0 : clamp((here - 0.5) * max(exp2(-level), 1.0) + 0.5, 0.0, 1.0);
}
