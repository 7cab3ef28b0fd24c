#include "camera_ray.glsl"
#include "skip.glsl"
#include "seen.glsl"
#include "normal.glsl"

// fragment(): traces the ray through a point of the image, and returns seen(). pixel: pixels, origin bottom left.
vec4 fragment(vec2 pixel) {
    vec3 direction = camera_ray(pixel, resolution, camera, focal);
    Hit ray = march(camera[3].xyz, direction, 2.0 / (focal * resolution.y), level, rounds, step_scale, schedule);
    vec3 normal = vec3(0.0, 1.0, 0.0);
    if (ray.hit) normal = normal_at(camera[3].xyz + ray.t * direction, pixel);
    return seen(ray, normal, direction, pixel);
}
