#include "skip.cuh"
#include "march.glsl"
#include "background.glsl"
#include "shade.glsl"
// colours.cuh: what main.glsl writes for a pixel, in two parts: without and with the field at the ray's end.

// A pixel whose colour does not need the field: the background, the steps, or the data (t, steps, level, hit).
__device__ inline vec4 plain(const Settings &s, int pixel, const Hit &ray) {
    float steps = static_cast<float>(ray.steps), hit = static_cast<float>(ray.hit);
    if (s.shading == SHADE_STEPS) return vec4(heat(steps / 64.0f), hit);
    if (s.shading == SHADE_DATA) return vec4(ray.t, steps, static_cast<float>(abs(ray.level)), hit);
    return vec4(background(s.centre(pixel), s.resolution, s.background_bottom, s.background_top), 0.0f);
}

// Whether pixels on the surface get a colour other than plain()'s.
__host__ __device__ inline bool shades_hits(const Settings &s) {
    return s.shading != SHADE_STEPS && s.shading != SHADE_DATA;
}

// sRGB, and alpha 1, of a pixel whose ray met the surface. t: distance along the ray; gradient: of the normal level,
// any length; albedo: sRGB.
__device__ inline vec4 surface_colour(const Settings &s, vec3 direction, float t, vec3 gradient, vec3 albedo) {
    const int steps = 0;  // shown by plain() alone
    vec3 toward = normalize(mat3(s.camera) * s.light);
    return vec4(shade(s.shading, normalize(gradient), direction, t, length(s.eye()), steps, albedo, toward,
                      s.camera[1].xyz),
                1.0f);
}
