// What the field of a scene is made of beside its networks (codegen/printers/composed.py): shapes in places of their own,
// joined. FADE: 1 over the share of a band in which the next level's residual fades out.

// v turned about an axis of length 1, by an angle of cosine c and sine s.
vec3 turned(vec3 v, vec3 axis, float c, float s) {
    return c * v + s * cross(axis, v) + (1. - c) * dot(axis, v) * axis;
}

// The value at a distance of `far` from a shape's middle, where f is its field there or on the unit sphere below.
float bounded(float f, float far) {
    float outside = far - 1., inside = max(f, 0.);
    return outside > 0. ? sqrt(outside * outside + inside * inside) : f;
}

// The share of the next level's residual where the field is f, in a band of half width delta.
float faded(float f, float delta) {
    return clamp((delta - abs(f)) * FADE / delta, 0., 1.);
}

// grad g.xyz and value g.w with a further level's, r, in its share.
vec4 refined(vec4 g, vec4 r, float delta) {
    float share = faded(g.w, delta);
    float bend = share < 1. ? -sign(g.w) * r.w * FADE / delta : 0.;
    return vec4((1. + bend) * g.xyz + share * r.xyz, g.w + share * r.w);
}

// The gradient of bounded(): g is that of the field, and the field; up: outwards, of length 1.
vec3 bounded_slope(vec4 g, vec3 up, float far) {
    float outside = far - 1., inside = max(g.w, 0.);
    vec3 along = (g.xyz - dot(g.xyz, up) * up) / far;
    float far_off = max(sqrt(outside * outside + inside * inside), 1e-12);
    return outside > 0. ? (outside * up + inside * along) / far_off : g.xyz;
}
