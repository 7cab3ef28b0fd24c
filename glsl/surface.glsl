#include "shade.glsl"
#include "base_colour.glsl"
uniform float split; // share of the width, from the left, that wears the traced level's own normals
// surface(): colour, sRGB, of a pixel whose ray has met the surface, under the mode `shading`.
// pixel: pixels, origin bottom left; direction: of the ray, length 1, model space; t: distance along it; steps: taken
// by march().
vec3 surface(vec2 pixel, vec3 direction, float t, int steps) {
    vec3 eye = camera[3].xyz;
    vec3 p = eye + t * direction;
    vec3 normal = normalize(field_gradient(p, pixel.x < split * resolution.x ? level : normal_level).xyz);
    vec3 toward = normalize(mat3(camera) * light);
    return shade(shading, normal, direction, t, length(eye), steps, base_colour(p), toward, camera[1].xyz);
}
