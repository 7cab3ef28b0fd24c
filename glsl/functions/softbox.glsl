// softbox(): the surface under a large key light and a sky, above a floor that reflects light; linear light.
// Above 0.6, a shoulder compresses values that would be clipped to 1 (phong.glsl).
// albedo: linear; normal, view (to the eye), light (to the key light): length 1, model space; open: openness(); delta:
// half-width of level 1's band; height: above the floor, model units.
vec3 softbox(vec3 albedo, vec3 normal, vec3 view, vec3 light, vec3 open, float delta, float height) {
    // A surface inside level 1's is in a crease that level 1 lacks.
    float sky = open.x * clamp(1.0 + 0.6 * open.z / delta, 0.5, 1.0);
    // A light as large as a fifth of its distance is still visible slightly below the horizon.
    float facing = dot(normal, light);
    float rising = clamp(facing + 0.2, 0.0, 0.4);
    float key = open.y * max(facing, 1.25 * rising * rising);
    float above = smoothstep(0.0, 1.0, 0.5 + 0.5 * normal.y);
    vec3 floor_light = sqrt(sky) * (1.0 - 0.75 / (1.0 + 4.0 * max(height, 0.0))) * vec3(0.30, 0.28, 0.26);
    vec3 diffuse = mix(floor_light, sky * vec3(0.40, 0.43, 0.48), above) + 0.86 * key * vec3(1.0, 0.97, 0.92);
    vec3 mirrored = reflect(-view, normal);
    float fresnel = 0.04 + 0.5 * pow(1.0 - max(dot(normal, view), 0.0), 5.0);
    float gloss = 0.9 * fresnel * sky * smoothstep(-0.2, 0.9, mirrored.y);
    gloss += 0.1 * open.y * pow(max(dot(mirrored, light), 0.0), 40.0);
    vec3 lit = albedo * diffuse + gloss;
    vec3 over = max(lit - 0.6, vec3(0.0));
    return lit - over + over / (1.0 + 2.0 * over);
}
