#include "coarse.glsl"
// openness(): how much of the sky (x) and of the key light (y) a point sees, each in [0, 1], traced through level 1 alone;
// z: how far the point is outside of level 1's surface.
// p: of the surface, or of the floor where `floored`, model space; normal, light (to the light): length 1; ground: height
// of the floor.
//
// The sky: the field at SKY_TAPS points on the normal, the farthest first; what it falls short of their distance from p is
// occluded (Evans, Fast approximations for global illumination on dynamic scenes, 2006). Where a point above the floor
// has next to nothing around it as far as that, the nearer ones have not, either.
// The light is a disc. Along a ray to its middle, the field over the way so far tells how far the shape is from that ray,
// in radii of the disc: from -1, where it hides the disc, to 1. Its least value is that of a parabola through three
// samples: the least sample itself would show the steps as stripes. The ray ends where all that is left of it in the unit
// ball, as wide as the disc, is free, and where it has left the shape behind and is far from it.
// Where the unit ball, which holds the shape, is too far to matter, the network is not asked.
const int SKY_TAPS = 5;
const int LIGHT_STEPS = 20;
const float SKY_REACH = 0.7; // of the last tap, model units
const float SKY_WEIGHTS = 3.2; // of all taps together
const float ENOUGH = 0.85; // of a point's distance from the floor: so much around it is next to nothing
const float LIGHT_SIZE = 0.16; // radius of the disc over its distance
const float CLEAR = 0.8; // of what is left of a ray in the ball, and of the disc's radius there: this is free
const float BEHIND = 0.4; // model units beyond the middle of the ball, toward the light, from which on a ray may end
const float AWAY = 4.0; // radii of the disc from the shape at which it does
const float LIFT = 0.25; // way from p, model units, after which level 1 counts as it is: p may be off its surface

vec3 openness(vec3 p, vec3 normal, vec3 light, float ground, bool floored) {
    float nearest = -dot(p, light); // where the ray to the light is nearest to the ball
    float passed = dot(p, p) - nearest * nearest;
    float beside = 1.0 + LIGHT_SIZE * max(nearest, 0.0);
    bool shaded = dot(normal, light) > -LIGHT_SIZE && passed < beside * beside && (nearest > 0.0 || dot(p, p) < 1.0);
    int last = SKY_TAPS + (shaded ? LIGHT_STEPS : 0);
    float here = 0.0;
    float occluded = 0.0;
    float cover = 1.0;
    float t = max(0.03, nearest - sqrt(max(1.0 - passed, 0.1)));
    vec2 before = vec2(0.0, 1.0); // (way, field over it) of the sample before
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
