#include "ball.glsl"
#include "schedules.glsl"
// march(): multiscale sphere tracing (Section 3.2, Appendix C): f_1 - delta_1, then f_2 - delta_2, ..., then f_level.
// origin, direction: model space, direction of length 1; footprint: width of a pixel at distance 1.
// rounds: largest number of passes through the levels; step_scale: factor on every step; schedule: see below.
// Reads delta[], iterations[], step_bound[], band_step_bound[] (one per level), field(), half_width(), skip() and NEAR. The
// bounds are factors on a level's steps: 1 if full steps never cross the surface, less if f exceeds the distance.
//
// Two additions to the paper's scheme prevent holes (docs/lessons.md). A ray that leaves a band without a hit returns
// to the coarser level, and passes through the levels again: hence rounds. And a band's offset surface is traced at
// half-width / 1.3, where delta / 1.3 = max |f_i(x_j)| (Eq. 5), so that a ray crosses the band's border in finitely many
// steps. A ray ends if it starts inside the shape or moves behind the eye. A ray stops within 1/20 pixel of the surface;
// a ray that has used all its rounds hits within 1/2 pixel.
//
// SCHEDULE_PLAIN: a step is the free sphere's radius, and all rays pass through the levels together, so that branches on
// the level are uniform on a GPU.
// SCHEDULE_RELAXED: over-relaxed. skip() jumps over empty space, the finest level defined at a point takes the step, and
// the step goes to where the surface is expected, but no farther than consecutive spheres overlap (relaxed_step()). Far
// from the shape, the field may exceed the distance by a third and spheres may not be free: steps are plain there.
const float STOP = 0.05; // pixels to the surface within which a ray stops
const float FLATTEST = 0.1; // smallest slope along a ray that predicts how far the surface is
const float STEEPEST = 4.0; // slope between a free sphere and a point inside, above which the sphere was not free
const float GAP = 0.005; // largest gap between two free spheres, model units, if a pixel is wider

struct Hit {
    bool hit;
    float t;
    int level; // current level; negative once the ray has ended
    int steps;
};

// Radius of the free sphere around a ray's point. f: field of the level `reached` there; width: half-width of its band.
float free_radius(float f, float width, int reached, int level, float step_scale) {
    bool last = reached == level;
    float bound = last ? step_bound[reached - 1] : band_step_bound[reached - 1];
    return step_scale * bound * (last ? f : f - width / 1.3);
}

// Moves a ray by a step, and sets whether it hits or ends.
void move_ray(inout Hit ray, float change, float f, int reached, int level, float pixel, float far) {
    bool last = reached == level;
    ray.t += change;
    ray.hit = last && f < 0.5 * pixel && ray.t <= far && ray.t >= 0.0;
    ray.level = last && abs(f) < STOP * pixel || ray.t > far || ray.t < 0.0 ? -reached : reached;
}

// One plain step of a ray at ray.level. f: field of `reached`, the finest level defined there; width: half-width of its
// band.
void plain_step(inout Hit ray, float f, float width, int reached, int level, float footprint, float far,
                float step_scale) {
    ++ray.steps;
    if (reached == ray.level && reached < level && abs(f) < width) {
        ++ray.level;
        return;
    }
    move_ray(ray, free_radius(f, width, reached, level, step_scale), f, reached, level, footprint * ray.t, far);
}

// One over-relaxed step. sphere: distance of the last free sphere along the ray, and its radius; radius 0: none.
//
// The radii of the last two spheres predict the surface. The step goes there, but no farther than 0.9 of the step after
// which the predicted next sphere would be a pixel from this one. Before the first step, the last sphere is the grid's,
// which may be too small by far, and so is the slope. The last step is short, since nothing checks it. If the prediction fails, with a gap of over a pixel, the
// ray returns to the end of the last sphere (Keinert et al., Enhanced sphere tracing, 2014; Balint and Valasek,
// Accelerating sphere tracing, 2018). Past the surface: false position between the last two points, even back beyond the
// last sphere if the slope shows that it was not free, since the grid may be wrong.
void relaxed_step(inout Hit ray, inout vec2 sphere, float f, float width, int reached, int level, float footprint,
                  float far, float step_scale) {
    ++ray.steps;
    float pixel = footprint * ray.t;
    float radius = free_radius(f, width, reached, level, step_scale);
    float moved = ray.t - sphere.x;
    float gap = min(pixel, GAP);
    bool known = sphere.y > 0.0 && moved > 0.0;
    if (known && radius > 0.0 && moved > sphere.y + radius + gap && moved > 1.00001 * sphere.y) {
        ray.t = sphere.x + sphere.y;
        ray.hit = false;
        ray.level = 1;
        sphere.y = 0.0;
        return;
    }
    float slope = known ? (sphere.y - radius) / moved : 1.0;
    float change = radius;
    if (known && radius < 0.0) {
        change = radius / min(slope, STEEPEST);
    } else {
        if (known && radius > 0.0 && radius < NEAR * gap) {
            float nearest = max(slope, 0.0);
            float touching = 0.9 * (2.0 * radius / (1.0 + nearest) + gap);
            bool predicts = ray.steps > 1 && f >= STOP * pixel;
            change = min(touching, radius / max(nearest, predicts ? FLATTEST : 0.5));
            change = max(change, radius);
        }
        sphere = vec2(ray.t, radius);
    }
    move_ray(ray, change, f, reached, level, pixel, far);
}

// Moves a ray, between two over-relaxed steps, past empty cells of the grid; ends it if only those are left.
// reads: number of reads of the grid so far.
void skip_cells(inout Hit ray, inout vec2 sphere, inout int reads, vec3 origin, vec3 direction, float footprint,
                float far, float step_scale) {
    if (ray.level == 1 && ray.t > 0.0) { // first check for an eye inside the shape
        ray.t = skip(origin, direction, ray.t, far, footprint, step_scale, sphere, reads);
        if (ray.t > far) ray.level = ray.steps > 0 ? -1 : 0;
    }
}

// Traces a ray from its current point. far: where it leaves the ball; sphere: see relaxed_step(); once: take only one step.
void continue_march(inout Hit ray, inout vec2 sphere, vec3 origin, vec3 direction, float footprint, int level,
                    int rounds, float step_scale, int schedule, float far, bool once) {
    int reads = 0;
    bool relaxed = schedule == SCHEDULE_RELAXED;
    for (int round = 0; round < rounds && ray.level > 0; ++round) {
        for (int phase = relaxed ? level : 1; phase <= level; ++phase) {
            for (int i = 0; i < iterations[phase - 1] && (relaxed ? ray.level > 0 : ray.level == phase); ++i) {
                if (relaxed) {
                    skip_cells(ray, sphere, reads, origin, direction, footprint, far, step_scale);
                    if (ray.level <= 0) break;
                }
                int reached;
                vec3 p = origin + ray.t * direction;
                float f = field(p, phase, reached);
                float width = half_width(p, reached);
                if (relaxed) relaxed_step(ray, sphere, f, width, reached, level, footprint, far, step_scale);
                else plain_step(ray, f, width, reached, level, footprint, far, step_scale);
                if (once) return;
            }
        }
    }
}

// Returns a ray at its entry into the ball; it has ended if it misses. span: distances (entry, exit).
Hit start_ray(vec2 span) {
    return Hit(false, max(span.x, 0.0), span.x < span.y && span.y > 0.0 ? 1 : 0, 0);
}

Hit march(vec3 origin, vec3 direction, float footprint, int level, int rounds, float step_scale, int schedule) {
    vec2 span = ball(origin, direction, 1.0 + delta[level - 1]);
    Hit ray = start_ray(span);
    vec2 sphere = vec2(0.0);
    continue_march(ray, sphere, origin, direction, footprint, level, rounds, step_scale, schedule, span.y, false);
    return ray;
}
