#include "camera_ray.glsl"
#include "place.glsl"
#include "skip.glsl"
#include "march.glsl"

// Second pass of a frame, where near.glsl lets a ray through: traces it.
// color: (t, steps, level that the ray ended in, hit); level 0: it never came near the shape.
void main() {
    vec3 direction = camera_ray(place(), resolution, camera, focal);
    Hit ray = march(camera[3].xyz, direction, 2.0 / (focal * resolution.y), level, rounds, step_scale, schedule);
    color = vec4(ray.t, float(ray.steps), float(abs(ray.level)), float(ray.hit));
}
