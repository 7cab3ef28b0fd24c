#include "ball.cuh"
#include "camera_ray.cuh"
// march(): multiscale sphere tracing (Section 3.2, Appendix C): f_1 - delta_1, then f_2 - delta_2, ..., then f_level.
// Why it goes through the levels in rounds, and why offsets are delta / 1.3: docs/method.md. A ray stops within 1/20
// pixel of the surface; one that is out of rounds hits within 1/2 pixel.
// Hit::level: at which the ray is traced next; 0: it is done.
struct Hit {
    int hit;
    float t;
    int level;
    int steps;
};

// A ray before its first step: at the ball, or done where it misses. far: where it leaves the ball.
__device__ inline Hit start(const Settings &s, vec3 direction, float &far) {
    Span span = ball(s.camera.d.xyz, direction, 1.0f + delta[s.level - 1]);
    far = span.exit;
    return Hit{0, fmaxf(span.entry, 0.0f), span.entry < span.exit && span.exit > 0.0f ? 1 : 0, 0};
}

// One step of a ray that is at ray.level, where the field is f, of the finest level `reached` that is defined there.
__device__ inline void advance(Hit &ray, float f, int reached, const Settings &s, float far) {
    ++ray.steps;
    if (reached == ray.level && reached < s.level && abs(f) < delta[reached - 1]) {
        ++ray.level;
        return;
    }
    bool last = reached == s.level;
    float pixel = 2.0f / (s.focal * static_cast<float>(s.height)) * ray.t;
    ray.t += s.step_scale * (last ? f : f - delta[reached - 1] / 1.3f);
    ray.hit = last && f < 0.5f * pixel && ray.t <= far;
    ray.level = (last && abs(f) < 0.05f * pixel) || ray.t > far ? 0 : reached;
}

__device__ inline Hit march(const Settings &s, vec3 direction) {
    float far;
    Hit ray = start(s, direction, far);
    for (int round = 0; round < s.rounds && ray.level > 0; ++round) {
        for (int phase = 1; phase <= s.level; ++phase) {
            for (int i = 0; i < iterations[phase - 1] && ray.level == phase; ++i) {
                int reached;
                float f = field(s.camera.d.xyz + ray.t * direction, phase, reached);
                advance(ray, f, reached, s, far);
            }
        }
    }
    return ray;
}
