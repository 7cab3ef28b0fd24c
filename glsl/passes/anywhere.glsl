#include "camera_ray.glsl"
#include "place.glsl"
#include "skip.glsl"
#include "seen.glsl"
#include "worn_level.glsl"
#ifdef FIRST_LOOK
#include "traced.glsl"
#else
#include "fragment.glsl"
#endif
// main.glsl for scattered pixels, too. FIRST_LOOK: trace by traced().
void main() {
    vec2 pixel = place();
#ifdef FIRST_LOOK
    vec3 direction = camera_ray(pixel, resolution, camera, focal), normal;
    Hit ray = traced(camera[3].xyz, direction, 2.0 / (focal * resolution.y), pixel, normal);
    color = seen(ray, normal, direction, pixel);
#else
    color = fragment(pixel);
#endif
}
