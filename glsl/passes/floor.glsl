#include "camera_ray.glsl"
#include "floor_distance.glsl"
#include "key_light.glsl"
#include "openness.glsl"
#include "sample_point.glsl"
#include "floor_openness.glsl"

// Pass of a frame in the shading softbox, before color.glsl: the floor's openness() at the lower left corners of blocks of pixels,
// one fragment per block; color.glsl interpolates between corners that differ little.
// color: (openness(), 1); 0 where a ray does not meet the floor.
void main() {
    vec2 pixel = FLOOR_BLOCK * (floor(gl_FragCoord.xy) + floor_corner) + 0.5 + jitter;
    vec3 eye = camera[3].xyz;
    vec3 direction = camera_ray(pixel, resolution, camera, focal);
    float t = floor_distance(eye, direction, ground);
    color = vec4(0.0);
    if (t > 0.0)
        color = vec4(openness(eye + t * direction, vec3(0.0, 1.0, 0.0), key_light(light, camera), ground, true), 1.0);
}
