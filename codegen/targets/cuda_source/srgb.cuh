// linear(), srgb(): sRGB to linear light and back, a channel in [0, 1] (IEC 61966-2-1).
__device__ inline float linear(float srgb) {
    float c = clamp(srgb, 0.0f, 1.0f);
    return c < 0.04045f ? c / 12.92f : powf((c + 0.055f) / 1.055f, 2.4f);
}

__device__ inline float srgb(float linear) {
    float c = clamp(linear, 0.0f, 1.0f);
    return c < 0.0031308f ? 12.92f * c : 1.055f * powf(c, 1.0f / 2.4f) - 0.055f;
}

__device__ inline vec3 linear(vec3 c) { return vec3(linear(c.x), linear(c.y), linear(c.z)); }
__device__ inline vec3 srgb(vec3 c) { return vec3(srgb(c.x), srgb(c.y), srgb(c.z)); }
