#include "coarse_field.glsl"
// openness(): visible shares of the sky (x) and of the key light (y), each in [0, 1], from level 1 only; z: field of level 1
// at p.
// p: on the surface, or on the floor if `floored`, model space; normal, light (to the light): length 1; ground: height of
// the floor.
//
// Sky: the field at SKY_TAPS points on the normal, farthest first. A field below the point's distance from p means
// occlusion (Evans, Fast approximations for global illumination on dynamic scenes, 2006). If a point above the floor has
// almost no occlusion, neither have the nearer points.
// Light: a disk. Along a ray to its center, the ratio of the field to the traveled distance is the distance between ray and
// shape in radii of the disk, from -1, where the shape hides the disk, to 1. The ratio takes the shape's edge for straight,
// which is wrong for parts smaller than the disk, so the floor's light is the mean of PARTS smaller disks. The ray to the
// first, in the middle, finds out where the shape may hide any of them; the others begin and end there.
// The samples of all rays are at the same distances, hence for the floor at the same heights of the shape: if they depended
// on p, so would the error of the minimum between them, and the penumbra would show ripples. For the same reason the
// minimum is that of a cubic whose slope is continuous. The network is not evaluated where the unit ball, which contains
// the shape, is too far to matter.
const int SKY_TAPS = 5;
const int PARTS = 5; // disks of the floor's light
const int LIGHT_STEPS = 16; // most samples of a ray
const float SKY_REACH = 0.7; // distance of the farthest tap, model units
const float SKY_WEIGHTS = 3.2; // sum of the weights of all taps
const float ENOUGH = 0.85; // field over a tap's distance above which occlusion counts as none
const float LIGHT_SIZE = 0.16; // radius of the light over its distance
const float PART_SIZE = 0.55; // radius of a part over the light's
const float PART_PLACE = 0.65; // distance of the outer parts from the middle, in radii of the light
const float LIGHT_FIRST = 0.03; // distance of the first sample; the next is LIGHT_GROWTH times it, plus LIGHT_STEP
const float LIGHT_GROWTH = 1.14;
const float LIGHT_STEP = 0.04;
const float LIGHT_STEADY = 0.8; // factor on steps over free space, since level 1 may exceed the distance
const float CLEAR = 0.8; // field over the rest of the ray in the ball plus the cone's end radius, above which it is free
const float LIFT = 0.25; // distance from p over which the field at p is subtracted, model units: level 1 may not be 0 at p

// Offset of the center of a part from the light's center, at distance 1.
vec3 part_offset(vec3 light, int part) {
    float flat_length = sqrt(light.x * light.x + light.z * light.z);
    vec3 across = vec3(1.0, 0.0, 0.0);
    if (flat_length > 0.001) across = vec3(light.z, 0.0, -light.x) / flat_length;
    vec3 up = vec3(light.y * across.z, light.z * across.x - light.x * across.z, -light.y * across.x);
    vec2 place = vec2(part == 1 || part == 4 ? -1.0 : 1.0, part > 2 ? -1.0 : 1.0) * sqrt(0.5);
    return LIGHT_SIZE * PART_PLACE * (place.x * across + place.y * up);
}

// The first distance of a sample, from t on, that is not below the goal.
float sample_from(float t, float goal) {
    while (t < goal) t = LIGHT_GROWTH * t + LIGHT_STEP;
    return t;
}

// The least value of a cubic between two places `width` apart, from its values and its slopes there, < 0 and > 0.
float cubic_minimum(float width, float start, float end, float slope, float slope_end) {
    float rise = end - start;
    float bend = 3.0 * rise - width * (2.0 * slope + slope_end);
    float twist = width * (slope + slope_end) - 2.0 * rise;
    float root = bend + sqrt(max(bend * bend - 3.0 * twist * width * slope, 0.0));
    float at = clamp(-width * slope / max(root, 0.000001), 0.0, 1.0);
    return start + at * (width * slope + at * (bend + at * twist));
}

vec3 openness(vec3 p, vec3 normal, vec3 light, float ground, bool floored) {
    float nearest = -dot(p, light); // distance along the light's ray to its point nearest to the origin
    float passed = dot(p, p) - nearest * nearest;
    float beside = 1.0 + LIGHT_SIZE * max(nearest, 0.0);
    bool shaded = dot(normal, light) > -LIGHT_SIZE && passed < beside * beside && (nearest > 0.0 || dot(p, p) < 1.0);
    int parts = floored ? PARTS : 1;
    int last = SKY_TAPS + (shaded ? parts * LIGHT_STEPS : 0);
    float size = floored ? LIGHT_SIZE * PART_SIZE : LIGHT_SIZE;
    float half_chord = sqrt(max(1.0 - passed, 0.1));
    float here = 0.0;
    float occluded = 0.0;
    float seen = shaded ? 0.0 : 1.0;
    int part = 0;
    vec3 toward = light;
    float cone = floored ? LIGHT_SIZE * (PART_SIZE + PART_PLACE) : LIGHT_SIZE; // radius at distance 1, of all parts
    float t = sample_from(LIGHT_FIRST, nearest - half_chord);
    float end = nearest + half_chord;
    float enter = 0.0; // first sample in the cone of all parts; 0: none yet
    float leave = 0.0; // first sample behind its last one
    int steps = 0;
    float cover = 1.0;
    vec2 before = vec2(0.0); // (distance, field over distance) of the previous sample
    vec2 last_but_one = vec2(0.0);
    float slope_before = 0.0;
    for (int i = floored ? 1 : 0; i <= last; ++i) {
        bool tap = i <= SKY_TAPS;
        float share = i == 0 ? 0.0 : float(SKY_TAPS + 1 - i) / float(SKY_TAPS);
        float way = tap ? SKY_REACH * share * share : t;
        vec3 q = p + way * (tap ? normal : toward);
        if (tap && floored && sqrt(dot(q, q)) - 1.0 >= way) {
            i = SKY_TAPS;
            continue;
        }
        float f = coarse_field(q);
        if (i == 0) here = f;
        f -= here * max(1.0 - way / LIFT, 0.0);
        if (tap) {
            float free = floored ? f : min(f, q.y - ground);
            occluded += i == 0 ? 0.0 : (1.0 - 0.6 * share) * clamp(1.0 - free / way, 0.0, 1.5);
            if (floored && free >= ENOUGH * way) i = SKY_TAPS;
            continue;
        }
        float ratio = f / (size * t);
        float slope = 0.0;
        cover = min(cover, ratio);
        if (steps > 1) {
            float width = before.x - last_but_one.x;
            float rise = (ratio - before.y) / (t - before.x);
            float rise_before = (before.y - last_but_one.y) / width;
            slope = (rise * width + rise_before * (t - before.x)) / (t - last_but_one.x);
            if (slope_before < 0.0 && slope > 0.0)
                cover = min(cover, cubic_minimum(width, last_but_one.y, before.y, slope_before, slope));
        }
        slope_before = slope;
        last_but_one = before;
        before = vec2(t, ratio);
        ++steps;
        t = sample_from(LIGHT_GROWTH * t + LIGHT_STEP, t + LIGHT_STEADY * (f - cone * t) / (1.0 + cone));
        if (part == 0 && f < cone * before.x) {
            if (enter == 0.0) enter = before.x;
            leave = t;
        }
        float left = max(end - before.x, 0.0);
        bool ends = t > (part == 0 ? end : leave) || f > CLEAR * (left + cone * (before.x + left));
        if (part > 0) ends = ends || cover < -1.0;
        if (!ends && steps < LIGHT_STEPS) continue;
        cover = clamp(cover, -1.0, 1.0);
        seen += 0.25 * (1.0 + cover) * (1.0 + cover) * (2.0 - cover);
        ++part;
        if (part == parts) break;
        if (enter == 0.0) {
            seen += float(parts - part);
            break;
        }
        toward = light + part_offset(light, part);
        cone = size;
        t = enter;
        steps = 0;
        cover = 1.0;
        slope_before = 0.0;
    }
    float sky = clamp(1.0 - occluded / SKY_WEIGHTS, 0.0, 1.0);
    return vec3(sky, shaded ? seen / float(parts) : 1.0, here);
}
