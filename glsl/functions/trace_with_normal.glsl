#include "skip.glsl"
#include "march.glsl"
#include "newton_step.glsl"
#include "normal_level_at.glsl"
uniform bool newton; // whether rays take newton_step() before they are traced
// trace_with_normal(): march(), and the normal of the surface or else of the floor, length 1, in one program.
// With `newton`, a ray takes one step from the end of the empty cells, and the gradient there usually ends it; the other
// rays continue. The field and its gradient are each called at one place, since drivers inline them at every call.
// pixel: point of the image, pixels, origin bottom left; march() explains the other arguments.
Hit trace_with_normal(vec3 origin, vec3 direction, float footprint, vec2 pixel, out vec3 normal) {
    vec2 span = ball(origin, direction, 1.0 + delta[level - 1]);
    Hit ray = start_ray(span);
    vec2 sphere = vec2(0.0);
    for (int turn = newton ? 0 : 1; turn < 2 && ray.level > 0; ++turn) {
        bool steps = turn == 0;
        continue_march(ray, sphere, origin, direction, footprint, level, rounds, step_scale, schedule, span.y, steps);
        int reads = 0;
        if (steps) skip_cells(ray, sphere, reads, origin, direction, footprint, span.y, step_scale);
        steps = steps && ray.level > 0;
        if (steps || ray.hit) {
            vec3 p = origin + ray.t * direction;
            float f;
            int reached;
            vec3 gradient = field_gradient(p, normal_level_at(pixel), f, reached).xyz;
            normal = normalize(gradient);
            if (steps)
                newton_step(ray, sphere, gradient, f, half_width(p, reached), reached, level, direction, footprint, span.y,
                            step_scale);
        }
    }
    if (!ray.hit) normal = vec3(0.0, 1.0, 0.0); // of the floor
    return ray;
}
