#include "camera_ray.glsl"
#include "sample_point.glsl"
#include "skip.glsl"
#include "march.glsl"
uniform sampler2D normals; // output of gradient.glsl

// Pass of a frame, where mask_near.glsl or mask_unfinished.glsl sets the mask: traces rays. After newton_step(), a ray
// continues from the state that gradient.glsl wrote.
// color: (t, steps, last level, hit); the level is negative if the ray has used all its rounds.
void main() {
    vec3 eye = camera[3].xyz;
    vec3 direction = camera_ray(sample_point(), resolution, camera, focal);
    float footprint = 2.0 / (focal * resolution.y);
    vec4 state = texelFetch(normals, ivec2(gl_FragCoord.xy), 0);
    if (state.a > 0.0) { // a hit already; drawn because of other pixels of its block
        color = vec4(state.a, 1.0, float(level), 1.0);
        return;
    }
    vec2 span = ball(eye, direction, 1.0 + delta[level - 1]);
    bool stepped = state.x > 0.0;
    Hit ray = Hit(false, stepped ? state.x : max(span.x, 0.0), stepped ? int(-state.a) : 1, int(stepped));
    if (ray.t > span.y) ray.level = -ray.level;
    vec2 sphere = state.yz;
    continue_march(ray, sphere, eye, direction, footprint, level, rounds, step_scale, schedule, span.y, false);
    color = vec4(ray.t, float(ray.steps), float(-ray.level), float(ray.hit));
}
