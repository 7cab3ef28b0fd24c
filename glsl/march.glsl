#include "ball.glsl"
// march(): multiscale sphere tracing (Section 3.2, Appendix C): f_1 - delta_1, then f_2 - delta_2, ..., then f_level.
// origin, direction: model space, direction of length 1; footprint: width of a pixel at distance 1.
// rounds: how often the sequence of levels is gone through; step_scale: factor on every step.
// Reads delta[], iterations[], step_bound[], band_step_bound[] (one per level) and field(). The bounds are factors on a
// level's steps: 1 where whole ones pass through no part of the shape, less where f exceeds the distance by too much.
//
// Two things are added to the paper's scheme, against holes (benchmarks/holes.py). A ray that leaves a band without
// having met the surface goes back to the coarser level, and the levels are gone through again: hence rounds. And a
// band's offset surface is traced at delta / 1.3 = max |f_i(x_j)| (Eq. 5), so that a ray crosses |f_i| = delta in
// finitely many steps. A ray that begins inside the shape, or goes back behind the eye, is done. A ray stops within 1/20 pixel of the surface; one that is out of rounds hits within 1/2 pixel.
// All rays go through the levels together: on a GPU the branches on the level are uniform.
struct Hit {
    bool hit;
    float t;
    int level; // where it is; minus that where it is done
    int steps;
};

// One step of a ray that is at ray.level, where the field is f, of the finest level `reached` that is defined there.
void advance(inout Hit ray, float f, int reached, int level, float footprint, float far, float step_scale) {
    ++ray.steps;
    if (reached == ray.level && reached < level && abs(f) < delta[reached - 1]) {
        ++ray.level;
        return;
    }
    bool last = reached == level;
    float pixel = footprint * ray.t;
    float bound = last ? step_bound[reached - 1] : band_step_bound[reached - 1];
    ray.t += step_scale * bound * (last ? f : f - delta[reached - 1] / 1.3);
    ray.hit = last && f < 0.5 * pixel && ray.t <= far && ray.t >= 0.0;
    ray.level = last && abs(f) < 0.05 * pixel || ray.t > far || ray.t < 0.0 ? -reached : reached;
}

Hit march(vec3 origin, vec3 direction, float footprint, int level, int rounds, float step_scale) {
    vec2 span = ball(origin, direction, 1.0 + delta[level - 1]);
    Hit ray = Hit(false, max(span.x, 0.0), span.x < span.y && span.y > 0.0 ? 1 : 0, 0);
    for (int round = 0; round < rounds && ray.level > 0; ++round) {
        for (int phase = 1; phase <= level; ++phase) {
            for (int i = 0; i < iterations[phase - 1] && ray.level == phase; ++i) {
                int reached;
                float f = field(origin + ray.t * direction, phase, reached);
                advance(ray, f, reached, level, footprint, span.y, step_scale);
            }
        }
    }
    return ray;
}
