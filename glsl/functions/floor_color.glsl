// floor_color(): the floor, linear light: the backdrop's color times the visible key light and sky, so that floor
// and backdrop blend. On a dark backdrop, the key light makes a bright pool.
// backdrop: linear; p: on the floor, model space; light: to the key light, length 1; open: openness(); above: height of
// the eye above the floor, model units; the floor is invisible from below.
vec3 floor_color(vec3 backdrop, vec3 p, vec3 light, vec3 open, float above) {
    float key = 0.9 * light.y;
    float sky = 0.45;
    float lit = (key * open.y + sky * open.x) / (key + sky);
    float dark = 1.0 - smoothstep(0.05, 0.5, dot(backdrop, vec3(1.0 / 3.0)));
    float far = dot(p, p) / 2.5;
    float pool = 1.0 + 1.4 * dark / (1.0 + far * far);
    return backdrop * mix(1.0, lit * pool, smoothstep(0.0, 0.3, above));
}
