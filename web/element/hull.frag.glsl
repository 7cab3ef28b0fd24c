// traced_hull(): the model in the fragment of its hull. Discards the fragment where the ray misses it, or meets it before the
// near plane; else sets the fragment's depth, and returns the point, model space.
varying vec3 at;
flat varying vec3 eye, ahead;
flat varying vec4 depth_z, depth_w;
flat varying mat3 into_world;
const float BEFORE = 4.0; // distance from the model's center at which the rays of an orthographic camera begin

vec3 traced_hull() {
    bool perspective = ahead == vec3(0.0);
    vec3 direction = perspective ? normalize(at - eye) : ahead;
    vec3 origin = perspective ? eye : at - (dot(at, ahead) + BEFORE) * ahead;
    // Half the width of a pixel at distance 1: march() accepts hits within half of it.
    vec3 moved = perspective ? direction : origin / BEFORE;
    float footprint = 0.5 * min(length(dFdx(moved)), length(dFdy(moved)));
    Hit ray = march(origin, direction, footprint, level, rounds, STEP_SCALE, SCHEDULE_RELAXED);
    vec3 p = origin + ray.t * direction;
    float z = dot(depth_z, vec4(p, 1.0)), w = dot(depth_w, vec4(p, 1.0));
    if (!ray.hit || z < -w) discard;
    gl_FragDepth = clamp(0.5 * z / w + 0.5, 0.0, 1.0);
    return p;
}
