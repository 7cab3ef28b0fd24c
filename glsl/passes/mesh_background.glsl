#include "background.glsl"
#include "camera_ray.glsl"
#include "shadings.glsl"
#include "floor_distance.glsl"
#include "key_light.glsl"
#include "openness.glsl"
#include "floor_color.glsl"
#include "linear.glsl"
#include "srgb.glsl"
// The fragment behind a mesh: the background and floor of main.glsl, alpha 0. SHADE_DATA writes (0, 0, 0, 0).
void main() {
    vec2 pixel = gl_FragCoord.xy + origin + jitter;
    color = vec4(background(pixel, resolution, background_bottom, background_top), 0.0);
    vec3 eye = camera[3].xyz;
    vec3 direction = camera_ray(pixel, resolution, camera, focal);
    float t = floor_distance(eye, direction, ground);
    if (shading == SHADE_SOFTBOX && t > 0.0) {
        vec3 p = eye + t * direction, toward = key_light(light, camera);
        vec3 open = openness(p, vec3(0.0, 1.0, 0.0), toward, ground, true);
        color.rgb = srgb(floor_color(linear(color.rgb), p, toward, open, eye.y - ground));
    }
    if (shading == SHADE_DATA) color = vec4(0.0);
}
