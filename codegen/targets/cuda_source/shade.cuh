#include "background.cuh"
#include "heat.cuh"
#include "phong.cuh"
#include "srgb.cuh"
// shade(): colour, sRGB, of a pixel whose ray hit, and alpha 1. gradient: of the normal level, any length; albedo:
// sRGB.
__device__ inline vec4 shade(const Settings &s, vec3 direction, float t, vec3 gradient, vec3 albedo) {
    vec3 normal = normalize(gradient);
    switch (s.shading) {
        case SHADE_NORMAL: return vec4(vec3(0.5f) + 0.5f * normal, 1.0f);
        case SHADE_DEPTH: return vec4(vec3(clamp(0.5f - 0.45f * (t - length(s.camera.d.xyz)), 0.0f, 1.0f)), 1.0f);
        case SHADE_TEXTURE: return vec4(albedo, 1.0f);
        default: break;
    }
    vec3 toward = normalize(rotate(s.camera, s.light));
    return vec4(srgb(phong(linear(albedo), normal, -direction, toward, s.camera.b.xyz)), 1.0f);
}

// A pixel whose colour needs no field: the background, steps, data (t, steps, level, hit).
__device__ inline vec4 plain(const Settings &s, int pixel, const Hit &ray) {
    float steps = static_cast<float>(ray.steps), hit = static_cast<float>(ray.hit);
    if (s.shading == SHADE_STEPS) return vec4(heat(steps / 64.0f), hit);
    if (s.shading == SHADE_DATA) return vec4(ray.t, steps, static_cast<float>(ray.level), hit);
    return vec4(background(s, pixel), 0.0f);
}

__host__ __device__ inline bool shades_hits(const Settings &s) {
    return s.shading != SHADE_STEPS && s.shading != SHADE_DATA;
}
