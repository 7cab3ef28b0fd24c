#include "camera_ray.glsl"
#include "sample_point.glsl"
#include "skip.glsl"
#include "ray_color.glsl"
#include "normal_level_at.glsl"
#ifdef NEWTON
#include "trace_with_normal.glsl"
#else
#include "pixel_color.glsl"
#endif
// main.glsl for scattered pixels, too. NEWTON: trace by trace_with_normal().
void main() {
    vec2 pixel = sample_point();
#ifdef NEWTON
    vec3 direction = camera_ray(pixel, resolution, camera, focal), normal;
    Hit ray = trace_with_normal(camera[3].xyz, direction, 2.0 / (focal * resolution.y), pixel, normal);
    color = ray_color(ray, normal, direction, pixel);
#else
    color = pixel_color(pixel);
#endif
}
