// phong(): Phong shading with one key light, a sky above and a warm ground below, linear light.
// albedo: linear; normal, view (to the eye), light (to the light), up: length 1, one space for all.
__device__ inline vec3 phong(vec3 albedo, vec3 normal, vec3 view, vec3 light, vec3 up) {
    float key = fmaxf(dot(normal, light), 0.0f);
    float highlight = powf(fmaxf(dot(reflect(-light, normal), view), 0.0f), 48.0f);
    float rim = powf(1.0f - fmaxf(dot(normal, view), 0.0f), 4.0f);
    vec3 ambient = mix(vec3(0.16f, 0.13f, 0.12f), vec3(0.34f, 0.38f, 0.46f), 0.5f + 0.5f * dot(normal, up));
    return albedo * (ambient + 1.05f * key * vec3(1.0f, 0.96f, 0.9f)) + vec3(0.14f * highlight + 0.10f * rim);
}
