// look(): one relaxed step of a ray at whose place the gradient is known: Newton's, which ends the ray, where that leads to
// the surface, else that of stride() in march.glsl. direction: of the ray, length 1, model space; the others: see there.
const float STEEP = 0.4; // least slope of f along a ray for that last step
const float LAST = 0.5; // pixels: its greatest length
const float ROUND = 0.008; // model units: where the shape is rounder than that, the last step ends within 1/20 pixel

void look(inout Hit ray, inout vec2 before, vec3 gradient, float f, float width, int reached, int level, vec3 direction,
          float footprint, float far, float step_scale) {
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
        stride(ray, before, f, width, reached, level, footprint, far, step_scale);
    }
}
