// floor_colour(): the floor of the studio, linear light: it is the backdrop itself, in the light of the key and the sky
// as far as it sees them, so that neither has an end. On a dark backdrop the key light leaves a pool of light.
// backdrop: linear; p: on the floor, model space; light: to the key light, length 1; open: openness(); above: height of
// the eye above the floor, model units; from below there is no floor.
vec3 floor_colour(vec3 backdrop, vec3 p, vec3 light, vec3 open, float above) {
    float key = 0.9 * light.y;
    float sky = 0.45;
    float lit = (key * open.y + sky * open.x) / (key + sky);
    float dark = 1.0 - smoothstep(0.05, 0.5, dot(backdrop, vec3(1.0 / 3.0)));
    float far = dot(p, p) / 2.5;
    float pool = 1.0 + 1.4 * dark / (1.0 + far * far);
    return backdrop * mix(1.0, lit * pool, smoothstep(0.0, 0.3, above));
}
