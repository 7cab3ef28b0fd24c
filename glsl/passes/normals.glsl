#include "camera_ray.glsl"
#include "place.glsl"
#include "skip.glsl"
#include "march.glsl"
#include "look.glsl"
#include "worn_level.glsl"
uniform sampler2D rays; // output of near.glsl and trace.glsl, or of a first look
#ifdef FIRST_LOOK
uniform bool first; // whether this is a first look
#else
const bool first = false;
#endif

// Passes of a frame that evaluate the gradient. The pass after trace.glsl computes the normals of its hits. The pass before
// trace.glsl is a first look: the grid of cells has brought most rays so close to the surface that the gradient gives the
// last step (Newton's) and the normal; the others take the first step of march(), and a second such pass their next step.
// color: (normal, t) of a hit; (t, before of march.glsl, minus the level) of a ray that continues.
void main() {
    vec3 eye = camera[3].xyz;
    vec2 image = place();
    vec3 direction = camera_ray(image, resolution, camera, focal);
    float footprint = 2.0 / (focal * resolution.y);
    vec2 span = ball(eye, direction, 1.0 + delta[level - 1]);
    vec4 given = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
    if (given.a == 0.0) { // not near the shape; drawn because of other pixels of its block
        color = vec4(0.0);
        return;
    }
    bool looked = given.a < 0.0;
    vec2 before = looked ? given.yz : vec2(0.0);
    int looks = 0;
    Hit ray = Hit(true, first && !looked ? max(span.x, 0.0) : given.x, looked ? int(-given.a) : 1, int(looked));
    if (first) leave_out(ray, before, looks, eye, direction, footprint, span.y, step_scale);
    vec3 p = eye + ray.t * direction;
    int shown = first ? level : worn_level(image);
#ifdef FIRST_LOOK
    float f;
    int reached;
    vec4 g = field_gradient(p, shown, f, reached);
    if (first) {
        look(ray, before, g.xyz, f, half_width(p, reached), reached, level, direction, footprint, span.y, step_scale);
        ray.hit = ray.hit && ray.level < 0;
    }
#else
    vec4 g = field_gradient(p, shown);
#endif
    color = ray.hit ? vec4(normalize(g.xyz), ray.t) : vec4(ray.t, before, -float(abs(ray.level)));
}
