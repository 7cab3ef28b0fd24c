#include "grid.cuh"
#include "cells.glsl"
#include "half_width.glsl"
#include "march.glsl"
// stepping.cuh: march() in parts, for `fused`, which takes one step of many rays at a time.
static_assert(sizeof(Hit) == 16, "a ray's state is four words of memory");

// State of a ray of the relaxed schedule between steps: see relaxed_step() and skip_cells().
struct alignas(16) Past {
    vec2 sphere;
    int reads;
};

// A ray before its first step: at its entry into the ball, or finished where it misses the ball. Without rounds, this
// is the whole march.
__device__ inline Hit start_ray(const Settings &s, vec3 direction) {
    return march(s.eye(), direction, s.footprint(), s.level, 0, s.step_scale, SCHEDULE_PLAIN);
}

// Distance along a ray at which it leaves the ball.
__device__ inline float exit_distance(const Settings &s, vec3 direction) {
    return ball(s.eye(), direction, 1.0f + delta[s.level - 1]).y;
}

// One plain step of a ray; f is the field, the value of level `reached`.
__device__ inline void plain_step(Hit &ray, float f, int reached, const Settings &s, float far) {
    plain_step(ray, f, delta[reached - 1], reached, s.level, s.footprint(), far, s.step_scale);
}

// Moves a ray of the relaxed schedule past empty cells of the grid.
__device__ inline void skip_cells(Hit &ray, Past &past, const Settings &s, vec3 direction, float far) {
    skip_cells(ray, past.sphere, past.reads, s.eye(), direction, s.footprint(), far, s.step_scale);
}

// One step of a ray in its schedule, up to the next evaluation of the field.
__device__ inline void take_step(Hit &ray, Past &past, float f, int reached, const Settings &s, vec3 direction, float far) {
    if (s.schedule == SCHEDULE_PLAIN) {
        plain_step(ray, f, reached, s, far);
        return;
    }
    relaxed_step(ray, past.sphere, f, delta[reached - 1], reached, s.level, s.footprint(), far, s.step_scale);
    if (ray.steps < s.rounds * iterations[s.level - 1]) skip_cells(ray, past, s, direction, far);
}

// The phase of a ray's next step; 0 or less where the ray is finished. Relaxed steps have only one phase, in which the
// field is that of the finest level that is defined.
__device__ inline int next_phase(const Hit &ray, const Settings &s) {
    return ray.level <= 0 || s.schedule == SCHEDULE_PLAIN ? ray.level : s.level;
}
