#include "background.glsl"
#include "camera_ray.glsl"
#include "place.glsl"
#include "to_floor.glsl"
#include "floor_light.glsl"
#include "surface.glsl"
uniform sampler2D rays; // output of near.glsl and trace.glsl
uniform sampler2D normals; // output of normals.glsl
#ifdef BLOCKS
uniform sampler2D later; // output of its second pass, for rays that hit after a first look
#endif

// Last pass of a frame, where behind.glsl sets the mask: colors of the surface and of the studio's floor.
// color.rgb is sRGB, color.a is 1 on the surface and 0 on the floor.
// BLOCKS: blocks.vert.glsl sets the mask, per block; some pixels of a block may have hit nothing.
void main() {
    vec4 ray = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
    vec2 pixel = place();
    vec3 direction = camera_ray(pixel, resolution, camera, focal);
    bool hit = ray.w > 0.5;
    vec4 end = texelFetch(normals, ivec2(gl_FragCoord.xy), 0);
#ifdef BLOCKS
    if (end.a <= 0.0) end = texelFetch(later, ivec2(gl_FragCoord.xy), 0);
#endif
    float t = hit ? end.a : to_floor(camera[3].xyz, direction, ground);
    vec3 normal = vec3(0.0, 1.0, 0.0);
    if (hit) normal = end.xyz;
#ifdef BLOCKS
    if (ray.w == 0.0 && (shading != SHADE_STUDIO || t <= 0.0)) discard;
#endif
    vec3 behind = background(pixel, resolution, background_bottom, background_top);
    color = vec4(surface(normal, direction, t, int(ray.y), hit, behind), ray.w);
}
