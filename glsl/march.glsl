#include "ball.glsl"
#include "schedules.glsl"
// march(): multiscale sphere tracing (Section 3.2, Appendix C): f_1 - delta_1, then f_2 - delta_2, ..., then f_level.
// origin, direction: model space, direction of length 1; footprint: width of a pixel at distance 1.
// rounds: how often the sequence of levels is gone through; step_scale: factor on every step; schedule: see below.
// Reads delta[], iterations[], step_bound[], band_step_bound[] (one per level), field(), half_width(), skip() and NEAR. The
// bounds are factors on a level's steps: 1 where whole ones pass through no part of the shape, less where f exceeds the
// distance by too much.
//
// Two things are added to the paper's scheme, against holes (benchmarks/holes.py). A ray that leaves a band without
// having met the surface goes back to the coarser level, and the levels are gone through again: hence rounds. And a
// band's offset surface is traced at its half width / 1.3, where delta / 1.3 = max |f_i(x_j)| (Eq. 5), so that a ray
// crosses the band's border in finitely many steps. A ray that begins inside the shape, or goes back behind the eye, is
// done. A ray stops within 1/20 pixel of the surface; one that is out of rounds hits within 1/2 pixel.
//
// SCHEDULE_PLAIN: a step is as long as the free sphere's radius, and all rays go through the levels together: on a GPU
// the branches on the level are uniform.
// SCHEDULE_RELAXED: skip() leaves out empty space, each step is taken by the finest level defined where it begins, and
// it goes where the surface is expected, but only so far that its sphere and the next one overlap (stride()). Large
// spheres may be none: far from the shape, the field may exceed the distance by a third. Steps are plain there.
const float STEEPEST = 4.0; // slope between a free sphere and a point inside above which the sphere is taken to be none
const float GAP = 0.005; // model units, of pixels that are wider: largest gap between two free spheres

struct Hit {
    bool hit;
    float t;
    int level; // where it is; minus that where it is done
    int steps;
};

// The radius of the sphere around a ray that is free of the shape by f, the field of level `reached`, whose band has the
// half width `width` there.
float free_radius(float f, float width, int reached, int level, float step_scale) {
    bool last = reached == level;
    float bound = last ? step_bound[reached - 1] : band_step_bound[reached - 1];
    return step_scale * bound * (last ? f : f - width / 1.3);
}

// Moves a ray by a step, and tells whether it hits there or is done.
void move(inout Hit ray, float change, float f, int reached, int level, float pixel, float far) {
    bool last = reached == level;
    ray.t += change;
    ray.hit = last && f < 0.5 * pixel && ray.t <= far && ray.t >= 0.0;
    ray.level = last && abs(f) < 0.05 * pixel || ray.t > far || ray.t < 0.0 ? -reached : reached;
}

// One plain step of a ray that is at ray.level, where the field is f, of the finest level `reached` that is defined, and
// the half width of its band is `width`.
void advance(inout Hit ray, float f, float width, int reached, int level, float footprint, float far,
             float step_scale) {
    ++ray.steps;
    if (reached == ray.level && reached < level && abs(f) < width) {
        ++ray.level;
        return;
    }
    move(ray, free_radius(f, width, reached, level, step_scale), f, reached, level, footprint * ray.t, far);
}

// One relaxed step. before: where the last free sphere is along the ray, and its radius; 0: there is none.
//
// The radii of this sphere and the last one say how fast the surface comes near. The step goes where it would be met, but
// no farther than nine tenths of the way to where the next sphere, if they go on like that, is a pixel away from this one;
// and where that turns out wrong, with a gap of over a pixel, back to the end of the last sphere (Keinert et al., Enhanced
// sphere tracing, 2014; Balint and Valasek, Accelerating sphere tracing, 2018). Past the surface, false position between
// the two, on to before the last sphere where the slope says that this one was not free: the grid may be wrong.
void stride(inout Hit ray, inout vec2 before, float f, float width, int reached, int level, float footprint,
            float far, float step_scale) {
    ++ray.steps;
    float pixel = footprint * ray.t;
    float radius = free_radius(f, width, reached, level, step_scale);
    float moved = ray.t - before.x;
    float gap = min(pixel, GAP);
    bool known = before.y > 0.0 && moved > 0.0;
    if (known && radius > 0.0 && moved > before.y + radius + gap && moved > 1.00001 * before.y) {
        ray.t = before.x + before.y;
        ray.hit = false;
        ray.level = 1;
        before.y = 0.0;
        return;
    }
    float slope = known ? (before.y - radius) / moved : 1.0;
    float change = radius;
    if (known && radius < 0.0) {
        change = radius / min(slope, STEEPEST);
    } else {
        if (known && radius > 0.0 && radius < NEAR * gap) {
            float nearest = max(slope, 0.0);
            float touching = 0.9 * (2.0 * radius / (1.0 + nearest) + gap);
            change = min(touching, radius / max(nearest, 0.5));
            change = max(change, radius);
        }
        before = vec2(ray.t, radius);
    }
    move(ray, change, f, reached, level, pixel, far);
}

// Takes a ray, between two relaxed steps, past what the grid says is empty; it is done where that is all that is left.
// looks: how often it has looked at the grid.
void leave_out(inout Hit ray, inout vec2 before, inout int looks, vec3 origin, vec3 direction, float footprint,
               float far, float step_scale) {
    if (ray.level == 1 && ray.t > 0.0) { // an eye inside the shape is found out first
        ray.t = skip(origin, direction, ray.t, far, footprint, step_scale, before, looks);
        if (ray.t > far) ray.level = ray.steps > 0 ? -1 : 0;
    }
}

// Traces a ray that is somewhere on its way; far: where it leaves the ball; before: see stride(); once: by one step.
void march_on(inout Hit ray, inout vec2 before, vec3 origin, vec3 direction, float footprint, int level, int rounds,
              float step_scale, int schedule, float far, bool once) {
    int looks = 0;
    bool relaxed = schedule == SCHEDULE_RELAXED;
    for (int round = 0; round < rounds && ray.level > 0; ++round) {
        for (int phase = relaxed ? level : 1; phase <= level; ++phase) {
            for (int i = 0; i < iterations[phase - 1] && (relaxed ? ray.level > 0 : ray.level == phase); ++i) {
                if (relaxed) {
                    leave_out(ray, before, looks, origin, direction, footprint, far, step_scale);
                    if (ray.level <= 0) break;
                }
                int reached;
                vec3 p = origin + ray.t * direction;
                float f = field(p, phase, reached);
                float width = half_width(p, reached);
                if (relaxed) stride(ray, before, f, width, reached, level, footprint, far, step_scale);
                else advance(ray, f, width, reached, level, footprint, far, step_scale);
                if (once) return;
            }
        }
    }
}

// A ray where it enters the ball, which it is in between the distances of `span`; it is done where it misses.
Hit entering(vec2 span) {
    return Hit(false, max(span.x, 0.0), span.x < span.y && span.y > 0.0 ? 1 : 0, 0);
}

Hit march(vec3 origin, vec3 direction, float footprint, int level, int rounds, float step_scale, int schedule) {
    vec2 span = ball(origin, direction, 1.0 + delta[level - 1]);
    Hit ray = entering(span);
    vec2 before = vec2(0.0);
    march_on(ray, before, origin, direction, footprint, level, rounds, step_scale, schedule, span.y, false);
    return ray;
}
