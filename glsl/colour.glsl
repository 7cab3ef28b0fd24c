#include "camera_ray.glsl"
#include "surface.glsl"
uniform sampler2D rays; // what near.glsl and trace.glsl wrote, pixel by pixel

// Fourth pass of a frame, where behind.glsl lets a ray through: the surface that it has met. color.rgb is sRGB, color.a 1.
void main() {
    vec4 ray = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
    vec2 pixel = gl_FragCoord.xy + origin + jitter;
    color = vec4(surface(pixel, camera_ray(pixel, resolution, camera, focal), ray.x, int(ray.y)), 1.0);
}
