#include "camera_ray.glsl"
#include "skip.glsl"
#include "ray_color.glsl"
#include "normal_at.glsl"

// pixel_color(): traces the ray through a point of the image, and returns ray_color(). pixel: pixels, origin bottom left.
vec4 pixel_color(vec2 pixel) {
    vec3 direction = camera_ray(pixel, resolution, camera, focal);
    Hit ray = march(camera[3].xyz, direction, 2.0 / (focal * resolution.y), level, rounds, step_scale, schedule);
    vec3 normal = vec3(0.0, 1.0, 0.0);
    if (ray.hit) normal = normal_at(camera[3].xyz + ray.t * direction, pixel);
    return ray_color(ray, normal, direction, pixel);
}
