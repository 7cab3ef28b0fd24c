#include "shade.glsl"
#ifndef WITHOUT_STUDIO
#include "key_light.glsl"
#include "openness.glsl"
#include "studio.glsl"
#include "floor_colour.glsl"
#endif
#include "base_colour.glsl"
// surface(): colour, sRGB, of a pixel whose ray has met the surface, under the mode `shading`, or the studio's floor.
// normal: of the surface, and direction: of the ray, length 1, model space; t: distance along it; steps: taken by march();
// hit: whether it is the surface that the ray has met; behind: sRGB, of the background in this pixel.
// With WITHOUT_STUDIO the mode is not SHADE_STUDIO, which compiles longer than all others together. With FLOOR_LIGHT,
// floor_light.glsl knows how open some of the floor is.
vec3 surface(vec3 normal, vec3 direction, float t, int steps, bool hit, vec3 behind) {
    vec3 eye = camera[3].xyz;
    vec3 p = eye + t * direction, albedo = vec3(0.0);
    if (hit) albedo = base_colour(p);
#ifndef WITHOUT_STUDIO
    if (shading == SHADE_STUDIO) {
        vec3 toward = key_light(light, camera);
        vec3 open;
#ifdef FLOOR_LIGHT
        if (hit || !floor_openness(open))
#endif
            open = openness(p, normal, toward, ground, !hit);
        if (!hit) return srgb(floor_colour(linear(behind), p, toward, open, eye.y - ground));
        return srgb(studio(linear(albedo), normal, -direction, toward, open, delta[0], p.y - ground));
    }
#endif
    return shade(shading, normal, direction, t, length(eye), steps, albedo, normalize(mat3(camera) * light), camera[1].xyz);
}
