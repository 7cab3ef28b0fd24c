// linear(): sRGB to linear light, each channel in [0, 1] (IEC 61966-2-1).
vec3 linear(vec3 srgb) {
    vec3 c = clamp(srgb, 0.0, 1.0);
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), c));
}
