#include "grid.cuh"
#include "cells.glsl"
#include "half_width.glsl"
#include "march.glsl"
#include "background.glsl"
#include "shade.glsl"
#include "floor_distance.glsl"
#include "key_light.glsl"
#include "openness.glsl"
#include "softbox.glsl"
#include "floor_color.glsl"
// colors.cuh: the color of a pixel in main.glsl, in two parts: without and with the gradient at the ray's end.

// The floor in a pixel whose ray missed the surface, or the background where the ray misses the floor too.
__device__ inline vec3 floor_or_background(const Settings &s, int pixel) {
    vec3 background_color = background(s.center(pixel), s.resolution, s.background_bottom, s.background_top);
    vec3 eye = s.eye(), direction = s.direction(pixel);
    float t = floor_distance(eye, direction, s.ground);
    if (s.shading != SHADE_SOFTBOX || t <= 0.0f) return background_color;
    vec3 p = eye + t * direction, toward = key_light(s.light, s.camera);
    vec3 open = openness(p, vec3(0.0f, 1.0f, 0.0f), toward, s.ground, true);
    return srgb(floor_color(linear(background_color), p, toward, open, eye.y - s.ground));
}

// A pixel whose color needs no gradient: the background, the steps, or the data (t, steps, level, hit).
__device__ inline vec4 plain(const Settings &s, int pixel, const Hit &ray) {
    float steps = static_cast<float>(ray.steps), hit = static_cast<float>(ray.hit);
    if (s.shading == SHADE_STEPS) return vec4(heat(steps / 32.0f), hit);
    if (s.shading == SHADE_DATA) return vec4(ray.t, steps, static_cast<float>(abs(ray.level)), hit);
    return vec4(ray.hit ? vec3(0.0f) : floor_or_background(s, pixel), 0.0f);
}

// Whether pixels on the surface have a color other than plain()'s.
__host__ __device__ inline bool shades_hits(const Settings &s) {
    return s.shading != SHADE_STEPS && s.shading != SHADE_DATA;
}

// sRGB and alpha 1 of a pixel whose ray hit the surface. t: distance along the ray; gradient: of the normal level, any
// length; albedo: sRGB.
__device__ inline vec4 surface_color(const Settings &s, vec3 direction, float t, vec3 gradient, vec3 albedo) {
    const int steps = 0;  // only plain() shows steps
    vec3 normal = normalize(gradient);
    if (s.shading == SHADE_SOFTBOX) {
        vec3 p = s.eye() + t * direction, key = key_light(s.light, s.camera);
        vec3 open = openness(p, normal, key, s.ground, false);
        return vec4(srgb(softbox(linear(albedo), normal, -direction, key, open, delta[0], p.y - s.ground)), 1.0f);
    }
    vec3 toward = normalize(mat3(s.camera) * s.light);
    return vec4(shade(s.shading, normal, direction, t, length(s.eye()), steps, albedo, toward,
                      s.camera[1].xyz),
                1.0f);
}
