#include "skip.glsl"
#include "march.glsl"
#include "look.glsl"
#include "worn_level.glsl"
uniform bool first; // whether rays take a first look
// traced(): march(), and the normal of the surface or else of the floor, length 1, in one program.
// In a first look, a ray takes one step from the end of the empty cells, and the gradient there usually ends it; the other
// rays continue. The field and its gradient are each called at one place, since drivers inline them at every call.
// pixel: point of the image, pixels, origin bottom left; march() explains the other arguments.
Hit traced(vec3 origin, vec3 direction, float footprint, vec2 pixel, out vec3 normal) {
    vec2 span = ball(origin, direction, 1.0 + delta[level - 1]);
    Hit ray = entering(span);
    vec2 before = vec2(0.0);
    for (int turn = first ? 0 : 1; turn < 2 && ray.level > 0; ++turn) {
        bool looks = turn == 0;
        march_on(ray, before, origin, direction, footprint, level, rounds, step_scale, schedule, span.y, looks);
        int count = 0;
        if (looks) leave_out(ray, before, count, origin, direction, footprint, span.y, step_scale);
        looks = looks && ray.level > 0;
        if (looks || ray.hit) {
            vec3 p = origin + ray.t * direction;
            float f;
            int reached;
            vec3 gradient = field_gradient(p, worn_level(pixel), f, reached).xyz;
            normal = normalize(gradient);
            if (looks)
                look(ray, before, gradient, f, half_width(p, reached), reached, level, direction, footprint, span.y, step_scale);
        }
    }
    if (!ray.hit) normal = vec3(0.0, 1.0, 0.0); // of the floor
    return ray;
}
