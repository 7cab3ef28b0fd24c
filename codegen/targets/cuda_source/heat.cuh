// heat(): colour, sRGB, of a share in [0, 1]: black, violet, red, orange, pale yellow.
__device__ inline vec3 heat(float share) {
    float x = 4.0f * clamp(share, 0.0f, 1.0f);
    vec3 colour = mix(vec3(0.01f, 0.01f, 0.05f), vec3(0.32f, 0.07f, 0.45f), clamp(x, 0.0f, 1.0f));
    colour = mix(colour, vec3(0.80f, 0.20f, 0.28f), clamp(x - 1.0f, 0.0f, 1.0f));
    colour = mix(colour, vec3(0.98f, 0.60f, 0.10f), clamp(x - 2.0f, 0.0f, 1.0f));
    return mix(colour, vec3(1.0f, 0.98f, 0.75f), clamp(x - 3.0f, 0.0f, 1.0f));
}
