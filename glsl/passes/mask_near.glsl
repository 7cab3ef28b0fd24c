#include "ball.glsl"
#include "camera_ray.glsl"
#include "sample_point.glsl"
#include "schedules.glsl"
#include "skip.glsl"

// First pass of a frame: finds the rays that come near the shape, by the ball and the grid of empty cells, without the
// field. Depth and color.a are 1 for these rays and 0 for others. color: as of trace.glsl, for a hit after one step or for
// a miss.
void main() {
    vec3 eye = camera[3].xyz;
    vec3 direction = camera_ray(sample_point(), resolution, camera, focal);
    vec2 span = ball(eye, direction, 1.0 + delta[level - 1]);
    float t = max(span.x, 0.0);
    bool near = span.x < span.y && span.y > 0.0;
    vec2 sphere = vec2(0.0);
    int reads = 0;
    if (near && schedule == SCHEDULE_RELAXED && t > 0.0)
        t = skip(eye, direction, t, span.y, 2.0 / (focal * resolution.y), step_scale, sphere, reads);
    near = near && t <= span.y;
    color = vec4(t, near ? vec3(1.0, float(level), 1.0) : vec3(0.0));
    gl_FragDepth = color.a;
}
