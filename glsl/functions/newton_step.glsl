// newton_step(): one step of a ray whose gradient is known: Newton's step, which ends the ray, if it reaches the surface,
// else relaxed_step() of march.glsl. direction: of the ray, length 1, model space; march.glsl explains the other arguments.
const float STEEP = 0.4; // least slope of f along the ray for Newton's step
const float LAST = 0.5; // largest length of Newton's step, pixels
const float ROUND = 0.008; // radius of curvature, model units, above which Newton's step ends within 1/20 pixel

void newton_step(inout Hit ray, inout vec2 sphere, vec3 gradient, float f, float width, int reached, int level,
                 vec3 direction, float footprint, float far, float step_scale) {
    float slope = -dot(gradient, direction);
    float change = f / max(slope, STEEP);
    float pixel = footprint * ray.t;
    bool near = abs(change) < LAST * pixel && change * change < 2.0 * ROUND * 0.05 * pixel;
    if (near && slope > STEEP && reached == level && ray.t + change <= far) {
        ++ray.steps;
        ray.t += change;
        ray.hit = true;
        ray.level = -reached;
    } else {
        relaxed_step(ray, sphere, f, width, reached, level, footprint, far, step_scale);
    }
}
