#include "worn_level.glsl"
// normal_at(): the surface's normal at a point p, model space, which the ray of a pixel has met; length 1.
// pixel: pixels, origin bottom left.
vec3 normal_at(vec3 p, vec2 pixel) {
    return normalize(field_gradient(p, worn_level(pixel)).xyz);
}
