#include "shade.glsl"
#ifndef WITHOUT_SOFTBOX
#include "key_light.glsl"
#include "openness.glsl"
#include "softbox.glsl"
#include "floor_color.glsl"
#endif
#include "base_color.glsl"
// surface_color(): color, sRGB, of a pixel whose ray meets the surface or the floor, in the mode `shading`.
// normal: of the surface; direction: of the ray; both length 1, model space. t: distance along the ray; steps: of march();
// hit: whether the ray meets the surface, not the floor; backdrop: the background's color in this pixel, sRGB.
// WITHOUT_SOFTBOX: the mode is not SHADE_SOFTBOX, which compiles longer than all others together. FLOOR_LIGHT:
// floor_openness.glsl has the openness of parts of the floor.
vec3 surface_color(vec3 normal, vec3 direction, float t, int steps, bool hit, vec3 backdrop) {
    vec3 eye = camera[3].xyz;
    vec3 p = eye + t * direction, albedo = vec3(0.0);
    if (hit) albedo = base_color(p);
#ifndef WITHOUT_SOFTBOX
    if (shading == SHADE_SOFTBOX) {
        vec3 toward = key_light(light, camera);
        vec3 open;
#ifdef FLOOR_LIGHT
        if (hit || !floor_openness(open))
#endif
            open = openness(p, normal, toward, ground, !hit);
        if (!hit) return srgb(floor_color(linear(backdrop), p, toward, open, eye.y - ground));
        return srgb(softbox(linear(albedo), normal, -direction, toward, open, delta[0], p.y - ground));
    }
#endif
    return shade(shading, normal, direction, t, length(eye), steps, albedo, normalize(mat3(camera) * light), camera[1].xyz);
}
