#include "background.glsl"
#include "camera_ray.glsl"
#include "sample_point.glsl"
#include "floor_distance.glsl"
#include "floor_openness.glsl"
#include "surface_color.glsl"
uniform sampler2D rays; // output of mask_near.glsl and trace.glsl
uniform sampler2D normals; // output of gradient.glsl
#ifdef BLOCKS
uniform sampler2D late_normals; // output of gradient.glsl after trace.glsl; `normals` holds those of newton_step()
#endif

// Last pass of a frame, where draw_background.glsl sets the mask: colors of the surface and of the floor.
// color.rgb is sRGB, color.a is 1 on the surface and 0 on the floor.
// BLOCKS: blocks.vert.glsl sets the mask, per block; some pixels of a block may have hit nothing.
void main() {
    vec4 ray = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
    vec2 pixel = sample_point();
    vec3 direction = camera_ray(pixel, resolution, camera, focal);
    bool hit = ray.w > 0.5;
    vec4 end = texelFetch(normals, ivec2(gl_FragCoord.xy), 0);
#ifdef BLOCKS
    if (end.a <= 0.0) end = texelFetch(late_normals, ivec2(gl_FragCoord.xy), 0);
#endif
    float t = hit ? end.a : floor_distance(camera[3].xyz, direction, ground);
    vec3 normal = vec3(0.0, 1.0, 0.0);
    if (hit) normal = end.xyz;
#ifdef BLOCKS
    if (ray.w == 0.0 && (shading != SHADE_SOFTBOX || t <= 0.0)) discard;
#endif
    vec3 backdrop = background(pixel, resolution, background_bottom, background_top);
    color = vec4(surface_color(normal, direction, t, int(ray.y), hit, backdrop), ray.w);
}
