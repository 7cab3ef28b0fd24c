#include "skip.cuh"
#include "march.glsl"
// stepping.cuh: march() in parts, for the variants that take one step of many rays at a time by advance().
static_assert(sizeof(Hit) == 16, "a ray's state is four words of memory");

// A ray before its first step: where it enters the ball, or done where it misses. A march of no rounds is that.
__device__ inline Hit entering(const Settings &s, vec3 direction) {
    return march(s.eye(), direction, s.footprint(), s.level, 0, s.step_scale, SCHEDULE_PLAIN);
}

// Where a ray leaves the ball, as the distance along it.
__device__ inline float leaving(const Settings &s, vec3 direction) {
    return ball(s.eye(), direction, 1.0f + delta[s.level - 1]).y;
}

// One step of a ray, where the field is f, the value of level `reached`.
__device__ inline void advance(Hit &ray, float f, int reached, const Settings &s, float far) {
    advance(ray, f, reached, s.level, s.footprint(), far, s.step_scale);
}
