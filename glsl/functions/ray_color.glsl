#include "background.glsl"
#include "march.glsl"
#include "floor_distance.glsl"
#include "surface_color.glsl"

// ray_color(): color of a traced ray. rgb is sRGB, a is 1 on the surface and 0 on the background.
// SHADE_DATA returns (t, steps, last level, hit) instead; level 0: the ray never came near the shape.
// normal: of the surface; direction: of the ray; both length 1, model space. pixel: point of the image, pixels, origin
// bottom left.
vec4 ray_color(Hit ray, vec3 normal, vec3 direction, vec2 pixel) {
    // Never true. With a discard, llvmpipe compiles one variant of the shader instead of two.
    if (resolution.x < 0.0) discard;
    vec4 color = vec4(background(pixel, resolution, background_bottom, background_top), float(ray.hit));
    float t = ray.hit || shading != SHADE_SOFTBOX ? ray.t : floor_distance(camera[3].xyz, direction, ground);
    if (ray.hit || shading == SHADE_SOFTBOX && t > 0.0)
        color.rgb = surface_color(normal, direction, t, ray.steps, ray.hit, color.rgb);
    if (shading == SHADE_STEPS) color = vec4(heat(float(ray.steps) / 32.0), color.a);
    if (shading == SHADE_DATA) color = vec4(ray.t, float(ray.steps), float(abs(ray.level)), float(ray.hit));
    return color;
}
