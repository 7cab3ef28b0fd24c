#include "camera_ray.glsl"
#include "place.glsl"
#include "skip.glsl"
#include "march.glsl"
uniform sampler2D normals; // output of normals.glsl

// Pass of a frame, where near.glsl or rest.glsl sets the mask: traces rays. After a first look (normals.glsl), a ray
// continues from the state that the look wrote.
// color: (t, steps, last level, hit); the level is negative if the ray has used all its rounds.
void main() {
    vec3 eye = camera[3].xyz;
    vec3 direction = camera_ray(place(), resolution, camera, focal);
    float footprint = 2.0 / (focal * resolution.y);
    vec4 left = texelFetch(normals, ivec2(gl_FragCoord.xy), 0);
    if (left.a > 0.0) { // a hit already; drawn because of other pixels of its block
        color = vec4(left.a, 1.0, float(level), 1.0);
        return;
    }
    vec2 span = ball(eye, direction, 1.0 + delta[level - 1]);
    bool looked = left.x > 0.0;
    Hit ray = Hit(false, looked ? left.x : max(span.x, 0.0), looked ? int(-left.a) : 1, int(looked));
    if (ray.t > span.y) ray.level = -ray.level;
    vec2 before = left.yz;
    march_on(ray, before, eye, direction, footprint, level, rounds, step_scale, schedule, span.y, false);
    color = vec4(ray.t, float(ray.steps), float(-ray.level), float(ray.hit));
}
