// phong(): Phong shading with one key light, a sky above and a warm ground below, linear light.
// Above 0.6, a shoulder compresses values that would be clipped to 1.
// albedo: linear; normal, view (to the eye), light (to the light), up: length 1, one space for all.
vec3 phong(vec3 albedo, vec3 normal, vec3 view, vec3 light, vec3 up) {
    float key = max(dot(normal, light), 0.0);
    float highlight = pow(max(dot(reflect(-light, normal), view), 0.0), 48.0);
    float rim = pow(1.0 - max(dot(normal, view), 0.0), 4.0);
    vec3 ambient = mix(vec3(0.16, 0.13, 0.12), vec3(0.34, 0.38, 0.46), 0.5 + 0.5 * dot(normal, up));
    vec3 lit = albedo * (ambient + 1.05 * key * vec3(1.0, 0.96, 0.9)) + 0.14 * highlight + 0.10 * rim;
    vec3 over = max(lit - 0.6, vec3(0.0));
    return lit - over + over / (1.0 + 2.0 * over);
}
