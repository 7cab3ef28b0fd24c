// The field of a scene without its networks (codegen/printers/scene_loops.py): placed shapes, combined. FADE: 1 over the share
// of a band in which the next level's residual fades out.

// Rotates v around an axis of length 1. c, s: cosine and sine of the angle.
vec3 turned(vec3 v, vec3 axis, float c, float s) {
    return c * v + s * cross(axis, v) + (1. - c) * dot(axis, v) * axis;
}

// Field at distance `far` from a shape's center. f: its field there or, outside, at the nearest point of the unit sphere.
float bounded(float f, float far) {
    float outside = far - 1., inside = max(f, 0.);
    return outside > 0. ? sqrt(outside * outside + inside * inside) : f;
}

// Weight of the next level's residual. f: field; delta: half-width of the band.
float faded(float f, float delta) {
    return clamp((delta - abs(f)) * FADE / delta, 0., 1.);
}

// Adds the next level's gradient and value r, weighted, to the gradient g.xyz and value g.w.
vec4 refined(vec4 g, vec4 r, float delta) {
    float share = faded(g.w, delta);
    float bend = share < 1. ? -sign(g.w) * r.w * FADE / delta : 0.;
    return vec4((1. + bend) * g.xyz + share * r.xyz, g.w + share * r.w);
}

// Gradient of bounded(). g: gradient and value of the field; up: outward, length 1.
vec3 bounded_slope(vec4 g, vec3 up, float far) {
    float outside = far - 1., inside = max(g.w, 0.);
    vec3 along = (g.xyz - dot(g.xyz, up) * up) / far;
    float far_off = max(sqrt(outside * outside + inside * inside), 1e-12);
    return outside > 0. ? (outside * up + inside * along) / far_off : g.xyz;
}
