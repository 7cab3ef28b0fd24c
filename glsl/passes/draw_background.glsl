#include "background.glsl"
#include "camera_ray.glsl"
#include "sample_point.glsl"
#include "heat.glsl"
#include "shadings.glsl"
#include "floor_distance.glsl"
uniform sampler2D rays; // output of mask_near.glsl and trace.glsl
uniform sampler2D normals; // output of gradient.glsl

// Pass of a frame: everything that needs no field: the background, SHADE_STEPS and SHADE_DATA.
// Writes depth 1 where the last pass, color.glsl, draws, and 0 elsewhere.
void main() {
    vec4 ray = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
    float end = texelFetch(normals, ivec2(gl_FragCoord.xy), 0).a;
    if (ray.w > 0.5 && end > 0.0) ray.x = end;
    vec2 pixel = sample_point();
    color = vec4(background(pixel, resolution, background_bottom, background_top), 0.0);
    if (shading == SHADE_STEPS) color = vec4(heat(ray.y / 32.0), ray.w);
    if (shading == SHADE_DATA) color = vec4(ray.xy, abs(ray.z), ray.w);
    gl_FragDepth = shading == SHADE_STEPS || shading == SHADE_DATA ? 0.0 : ray.w;
    if (shading == SHADE_SOFTBOX && floor_distance(camera[3].xyz, camera_ray(pixel, resolution, camera, focal), ground) > 0.0)
        gl_FragDepth = 1.0;
}
