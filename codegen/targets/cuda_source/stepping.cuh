#include "grid.cuh"
#include "cells.glsl"
#include "half_width.glsl"
#include "march.glsl"
// stepping.cuh: march() in parts, for the variants that take one step of many rays at a time.
static_assert(sizeof(Hit) == 16, "a ray's state is four words of memory");

// What a ray of the relaxed schedule remembers from step to step: see stride() and leave_out().
struct alignas(16) Past {
    vec2 before;
    int looks;
};

// A ray before its first step: where it enters the ball, or done where it misses. A march of no rounds is that.
__device__ inline Hit entering(const Settings &s, vec3 direction) {
    return march(s.eye(), direction, s.footprint(), s.level, 0, s.step_scale, SCHEDULE_PLAIN);
}

// Where a ray leaves the ball, as the distance along it.
__device__ inline float leaving(const Settings &s, vec3 direction) {
    return ball(s.eye(), direction, 1.0f + delta[s.level - 1]).y;
}

// One plain step of a ray, where the field is f, the value of level `reached`.
__device__ inline void advance(Hit &ray, float f, int reached, const Settings &s, float far) {
    advance(ray, f, delta[reached - 1], reached, s.level, s.footprint(), far, s.step_scale);
}

// Takes a ray of the relaxed schedule past what the grid says is empty.
__device__ inline void leave_out(Hit &ray, Past &past, const Settings &s, vec3 direction, float far) {
    leave_out(ray, past.before, past.looks, s.eye(), direction, s.footprint(), far, s.step_scale);
}

// One step of a ray by its schedule, and on to where the field is asked next.
__device__ inline void go_on(Hit &ray, Past &past, float f, int reached, const Settings &s, vec3 direction, float far) {
    if (s.schedule == SCHEDULE_PLAIN) {
        advance(ray, f, reached, s, far);
        return;
    }
    stride(ray, past.before, f, delta[reached - 1], reached, s.level, s.footprint(), far, s.step_scale);
    if (ray.steps < s.rounds * iterations[s.level - 1]) leave_out(ray, past, s, direction, far);
}

// The phase that a ray's next step is of, 0 or less where it is done. Relaxed steps are all of one, in which the field is
// that of the finest level that is defined.
__device__ inline int next_phase(const Hit &ray, const Settings &s) {
    return ray.level <= 0 || s.schedule == SCHEDULE_PLAIN ? ray.level : s.level;
}
