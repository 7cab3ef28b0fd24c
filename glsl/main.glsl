#include "background.glsl"
#include "camera_ray.glsl"
#include "skip.glsl"
#include "march.glsl"
#include "to_floor.glsl"
#include "surface.glsl"

// The fragment: one ray. color.rgb is sRGB, color.a is 1 on the surface and 0 on the background.
// SHADE_DATA writes (t, steps, level that the ray ended in, hit) instead; level 0: it never came near the shape.
void main() {
    // Never true; a shader that may discard compiles in half the time on llvmpipe (one variant instead of two).
    if (resolution.x < 0.0) discard;
    vec2 pixel = gl_FragCoord.xy + origin + jitter;
    vec3 direction = camera_ray(pixel, resolution, camera, focal);
    Hit ray = march(camera[3].xyz, direction, 2.0 / (focal * resolution.y), level, rounds, step_scale, schedule);
    color = vec4(background(pixel, resolution, background_bottom, background_top), float(ray.hit));
    float t = ray.hit || shading != SHADE_STUDIO ? ray.t : to_floor(camera[3].xyz, direction, ground);
    if (ray.hit || shading == SHADE_STUDIO && t > 0.0)
        color.rgb = surface(pixel, direction, t, ray.steps, ray.hit, color.rgb);
    if (shading == SHADE_STEPS) color = vec4(heat(float(ray.steps) / 32.0), color.a);
    if (shading == SHADE_DATA) color = vec4(ray.t, float(ray.steps), float(abs(ray.level)), float(ray.hit));
}
