#include "camera_ray.glsl"
#include "place.glsl"
#include "skip.glsl"
#include "march.glsl"
#include "look.glsl"
#include "worn_level.glsl"
uniform sampler2D rays; // what near.glsl and trace.glsl wrote, pixel by pixel; or what a first look left
#ifdef FIRST_LOOK
uniform bool first; // whether this is a look at rays that the grid has brought close to the surface
#else
const bool first = false;
#endif

// Passes of a frame that evaluate the gradient. The last one gives normals to the rays that trace.glsl says have hit. The
// first one, before trace.glsl, gives them to rays that the grid of cells has brought close enough to the surface for the
// gradient to take the last step (Newton's), which are most of them, and makes the first step of march() for the others.
// It may be drawn a second time, for the next step of these.
// color: (normal, t) of a ray that has hit; (t, before of march.glsl, minus the level that it is at) of one that goes on.
void main() {
    vec3 eye = camera[3].xyz;
    vec2 image = place();
    vec3 direction = camera_ray(image, resolution, camera, focal);
    float footprint = 2.0 / (focal * resolution.y);
    vec2 span = ball(eye, direction, 1.0 + delta[level - 1]);
    vec4 given = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
    if (given.a == 0.0) { // it comes nowhere near, and draws because others of its block do
        color = vec4(0.0);
        return;
    }
    bool looked = given.a < 0.0;
    vec2 before = looked ? given.yz : vec2(0.0);
    int looks = 0;
    Hit ray = Hit(true, first && !looked ? max(span.x, 0.0) : given.x, looked ? int(-given.a) : 1, 0);
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
