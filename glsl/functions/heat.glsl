// heat(): color map of [0, 1], sRGB: black, violet, red, orange, pale yellow.
vec3 heat(float share) {
    float x = 4.0 * clamp(share, 0.0, 1.0);
    vec3 color = mix(vec3(0.01, 0.01, 0.05), vec3(0.32, 0.07, 0.45), clamp(x, 0.0, 1.0));
    color = mix(color, vec3(0.80, 0.20, 0.28), clamp(x - 1.0, 0.0, 1.0));
    color = mix(color, vec3(0.98, 0.60, 0.10), clamp(x - 2.0, 0.0, 1.0));
    return mix(color, vec3(1.0, 0.98, 0.75), clamp(x - 3.0, 0.0, 1.0));
}
