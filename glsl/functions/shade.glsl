#include "heat.glsl"
#include "linear.glsl"
#include "phong.glsl"
#include "shadings.glsl"
#include "srgb.glsl"
// shade(): color of the surface, sRGB, in a shading mode.
// normal: length 1; direction: of the ray, length 1; t: distance along it; steps: taken by march().
// albedo: sRGB; light (to the light), up: length 1. All in model space. eye: distance of the eye from the origin.
vec3 shade(int shading, vec3 normal, vec3 direction, float t, float eye, int steps, vec3 albedo, vec3 light, vec3 up) {
    if (shading == SHADE_NORMAL) return 0.5 + 0.5 * normal;
    if (shading == SHADE_DEPTH) return vec3(clamp(0.5 - 0.45 * (t - eye), 0.0, 1.0));
    if (shading == SHADE_STEPS) return heat(float(steps) / 32.0);
    if (shading == SHADE_TEXTURE) return albedo;
    return srgb(phong(linear(albedo), normal, -direction, light, up));
}
