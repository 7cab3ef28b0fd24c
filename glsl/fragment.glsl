#include "background.glsl"
#include "camera_ray.glsl"
#include "skip.glsl"
#include "march.glsl"
#include "to_floor.glsl"
#include "normal.glsl"
#include "surface.glsl"

// fragment(): what one ray sees. rgb is sRGB, a is 1 on the surface and 0 on the background.
// SHADE_DATA gives (t, steps, level that the ray ended in, hit) instead; level 0: it never came near the shape.
// pixel: the point of the image that the ray goes through, pixels, origin bottom left.
vec4 fragment(vec2 pixel) {
    // Never true; a shader that may discard compiles in half the time on llvmpipe (one variant instead of two).
    if (resolution.x < 0.0) discard;
    vec3 direction = camera_ray(pixel, resolution, camera, focal);
    Hit ray = march(camera[3].xyz, direction, 2.0 / (focal * resolution.y), level, rounds, step_scale, schedule);
    vec4 seen = vec4(background(pixel, resolution, background_bottom, background_top), float(ray.hit));
    float t = ray.hit || shading != SHADE_STUDIO ? ray.t : to_floor(camera[3].xyz, direction, ground);
    if (ray.hit || shading == SHADE_STUDIO && t > 0.0) {
        vec3 normal = vec3(0.0, 1.0, 0.0);
        if (ray.hit) normal = normal_at(camera[3].xyz + t * direction, pixel);
        seen.rgb = surface(normal, direction, t, ray.steps, ray.hit, seen.rgb);
    }
    if (shading == SHADE_STEPS) seen = vec4(heat(float(ray.steps) / 32.0), seen.a);
    if (shading == SHADE_DATA) seen = vec4(ray.t, float(ray.steps), float(abs(ray.level)), float(ray.hit));
    return seen;
}
