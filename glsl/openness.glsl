#include "coarse.glsl"
// openness(): visible shares of the sky (x) and of the key light (y), each in [0, 1], from level 1 only; z: field of level 1
// at p.
// p: on the surface, or on the floor if `floored`, model space; normal, light (to the light): length 1; ground: height of
// the floor.
//
// Sky: the field at SKY_TAPS points on the normal, farthest first. A field below the point's distance from p means
// occlusion (Evans, Fast approximations for global illumination on dynamic scenes, 2006). If a point above the floor has
// almost no occlusion, neither have the nearer points.
// Light: a disk. Along a ray to its center, the ratio of the field to the traveled distance is the distance between ray and
// shape in radii of the disk, from -1, where the shape hides the disk, to 1. The minimum comes from a parabola through
// three samples: the least sample itself would show stripes. The ray ends where its remaining cone in the unit ball is
// free, or where it is past the shape and far from it.
// The network is not evaluated where the unit ball, which contains the shape, is too far to matter.
const int SKY_TAPS = 5;
const int LIGHT_STEPS = 20;
const float SKY_REACH = 0.7; // distance of the farthest tap, model units
const float SKY_WEIGHTS = 3.2; // sum of the weights of all taps
const float ENOUGH = 0.85; // field over a tap's distance above which occlusion counts as none
const float LIGHT_SIZE = 0.16; // radius of the disk over its distance
const float CLEAR = 0.8; // field over the rest of the ray in the ball plus the cone's end radius, above which it is free
const float BEHIND = 0.4; // model units past the ball's center, toward the light, after which a ray may end
const float AWAY = 4.0; // distance from the shape at which it ends, radii of the disk
const float LIFT = 0.25; // distance from p over which the field at p is subtracted, model units: level 1 may not be 0 at p

vec3 openness(vec3 p, vec3 normal, vec3 light, float ground, bool floored) {
    float nearest = -dot(p, light); // distance along the light's ray to its point nearest to the origin
    float passed = dot(p, p) - nearest * nearest;
    float beside = 1.0 + LIGHT_SIZE * max(nearest, 0.0);
    bool shaded = dot(normal, light) > -LIGHT_SIZE && passed < beside * beside && (nearest > 0.0 || dot(p, p) < 1.0);
    int last = SKY_TAPS + (shaded ? LIGHT_STEPS : 0);
    float here = 0.0;
    float occluded = 0.0;
    float cover = 1.0;
    float t = max(0.03, nearest - sqrt(max(1.0 - passed, 0.1)));
    vec2 before = vec2(0.0, 1.0); // (distance, field over distance) of the previous sample
    vec2 last_but_one = vec2(-1.0, 1.0);
    for (int i = floored ? 1 : 0; i <= last; ++i) {
        bool tap = i <= SKY_TAPS;
        float share = i == 0 ? 0.0 : float(SKY_TAPS + 1 - i) / float(SKY_TAPS);
        float way = tap ? SKY_REACH * share * share : t;
        vec3 q = p + way * (tap ? normal : light);
        float outside = sqrt(dot(q, q)) - 1.0;
        bool away = outside >= (tap ? way : LIGHT_SIZE * t * cover);
        if (away && (tap ? floored : dot(q, light) > 0.0)) {
            if (!tap) break;
            i = SKY_TAPS;
            continue;
        }
        float f = coarse(q);
        if (i == 0) here = f;
        f -= here * max(1.0 - way / LIFT, 0.0);
        if (tap) {
            float free = floored ? f : min(f, q.y - ground);
            occluded += i == 0 ? 0.0 : (1.0 - 0.6 * share) * clamp(1.0 - free / way, 0.0, 1.5);
            if (floored && free >= ENOUGH * way) i = SKY_TAPS;
            continue;
        }
        float ratio = f / (LIGHT_SIZE * t);
        float rise = (ratio - before.y) / (t - before.x);
        float rise_before = (before.y - last_but_one.y) / (before.x - last_but_one.x);
        float bend = (rise - rise_before) / (t - last_but_one.x);
        float least = ratio;
        if (last_but_one.x > 0.0 && rise_before < 0.0 && rise > 0.0) {
            float at = 0.5 * (before.x + last_but_one.x) - 0.5 * rise_before / bend;
            least = last_but_one.y + (at - last_but_one.x) * (rise_before + bend * (at - before.x));
        }
        cover = min(cover, least);
        float left = nearest + sqrt(max(1.0 - passed, 0.0)) - t;
        if (cover < -1.0 || f > CLEAR * (left + LIGHT_SIZE * (t + left))) break;
        if (ratio > AWAY && rise > 0.0 && before.x > 0.0 && dot(q, light) > BEHIND) break;
        last_but_one = before;
        before = vec2(t, ratio);
        t += max(abs(f) * clamp(0.55 + 0.15 * ratio, 0.7, 1.0), 0.02 + 0.12 * t);
    }
    cover = clamp(cover, -1.0, 1.0);
    float sky = clamp(1.0 - occluded / SKY_WEIGHTS, 0.0, 1.0);
    return vec3(sky, 0.25 * (1.0 + cover) * (1.0 + cover) * (2.0 - cover), here);
}
