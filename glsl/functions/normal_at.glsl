#include "normal_level_at.glsl"
// normal_at(): the surface's normal, length 1, at p, model space, where the ray of a pixel hits.
// pixel: pixels, origin bottom left.
vec3 normal_at(vec3 p, vec2 pixel) {
    return normalize(field_gradient(p, normal_level_at(pixel)).xyz);
}
