#include "camera_ray.glsl"
#include "sample_point.glsl"
#include "skip.glsl"
#include "march.glsl"
#include "newton_step.glsl"
#include "normal_level_at.glsl"
uniform sampler2D rays; // output of mask_near.glsl and trace.glsl, or of this pass with `newton`
#ifdef NEWTON
uniform bool newton; // whether it is drawn before trace.glsl, for newton_step(); else after it, for the normals
#else
const bool newton = false;
#endif

// Pass of a frame that evaluates the gradient; a frame draws it at two places. After trace.glsl, it computes the normals of
// the hits. Before trace.glsl, it takes newton_step(): the grid of cells has brought most rays so close to the surface that
// the gradient gives the last step and the normal; the others take the first step of march(), and their next one where the
// pass is drawn once more.
// color: (normal, t) of a hit; (t, sphere of march.glsl, minus the level) of a ray that continues.
void main() {
    vec3 eye = camera[3].xyz;
    vec2 image = sample_point();
    vec3 direction = camera_ray(image, resolution, camera, focal);
    float footprint = 2.0 / (focal * resolution.y);
    vec2 span = ball(eye, direction, 1.0 + delta[level - 1]);
    vec4 state = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
    if (state.a == 0.0) { // not near the shape; drawn because of other pixels of its block
        color = vec4(0.0);
        return;
    }
    bool stepped = state.a < 0.0;
    vec2 sphere = stepped ? state.yz : vec2(0.0);
    int reads = 0;
    Hit ray = Hit(true, newton && !stepped ? max(span.x, 0.0) : state.x, stepped ? int(-state.a) : 1, int(stepped));
    if (newton) skip_cells(ray, sphere, reads, eye, direction, footprint, span.y, step_scale);
    vec3 p = eye + ray.t * direction;
    int shown = newton ? level : normal_level_at(image);
#ifdef NEWTON
    float f;
    int reached;
    vec4 g = field_gradient(p, shown, f, reached);
    if (newton) {
        newton_step(ray, sphere, g.xyz, f, half_width(p, reached), reached, level, direction, footprint, span.y, step_scale);
        ray.hit = ray.hit && ray.level < 0;
    }
#else
    vec4 g = field_gradient(p, shown);
#endif
    color = ray.hit ? vec4(normalize(g.xyz), ray.t) : vec4(ray.t, sphere, -float(abs(ray.level)));
}
