// mainImage(): main.glsl in few characters, for Shadertoy's Image tab: the same camera and light, a slow turntable, and
// dragging orbits. Shadertoy tells where the button went down and where the mouse is, or was when it went up, and nothing
// of drags before: a drag adds to the turn, which goes on, and the next one begins without the last one's share.
// The field's text must stand here once and be called at one place: the loop traces the ray (tap -1), then takes four
// samples around the surface for the normal (tap 0 to 3). Loops that begin at min(iFrame, 0) are not unrolled.
// o: colour; q: pixel; r: resolution; z: the smaller side; a: azimuth, elevation; m: camera, columns right, up, back;
// j: sample; u: a point of the image, in it; v, l: directions of the ray and to the light; n: normal; e: offset of a
// tap, later what of the colour is over .6; w: colour of a sample, linear light; t: along the ray; h: where it leaves the
// ball or the hull that the shape is in, which stands in place of ENTER.
// Steps are as in march.glsl: p: radius of the last free sphere, 0: none; d: how far behind its middle is; s: how fast the
// surface comes near; g: gap that is allowed; b: the step (codegen/reference/short_march.py).
void mainImage(out vec4 o, vec2 q) {
    vec2 r = iResolution.xy, u;
    float z = min(r.x, r.y);
    vec2 a = radians(VIEW) + vec2(SPEED * iTime, 0) - 3.14 * (iMouse.xy - abs(iMouse.zw)) / z, s, c;
    a.y = clamp(a.y, -1.4, 1.4);
    s = sin(a);
    c = cos(a);
    mat3 m = mat3(c.x, 0, -s.x, -s.y * s.x, c.y, -s.y * c.x, c.y * s.x, s.y, c.y * c.x);
    vec3 l = m * normalize(LIGHT);
    o = vec4(0);
    for (int j = min(iFrame, 0); j < AA * AA; j++) {
        u = q + (vec2(j % AA, j / AA) + .5) / float(AA) - .5;
        vec3 v = normalize(m * vec3((2. * u - r) / z, -3.17)), n = vec3(0), e, w = pow(mix(BOTTOM, TOP, u.y / r.y), vec3(2.2));
        float t = 0., h, p = 0., d = 1., s, f, g, b;
        ENTER
        int k = -1;
        for (int i = min(iFrame, 0); i < STEPS && k < 4 && t < h; i++) {
            e = k < 0 ? vec3(0) : vec3(k + 3 >> 1 & 1, k >> 1 & 1, k & 1) - .5;
            f = field(vec4(3.52 * m[2] + t * v + .002 * e, 1));
            if (k >= 0) { n += f * e; k++; }
            else if (abs(f) < .06 * t / z) k = 0;
            else {
                f *= BOUND;
                g = min(.63 * t / z, .005);
                s = p > 0. ? (p - f) / d : 1.;
                b = f;
                if (f < 0.) d += b /= s;
                else if (p > 0. && d > p + f + g) { b = p - d; p = 0.; }
                else {
                    if (f < 3. * g) b = max(f, min(1.8 * f / (1. + max(s, 0.)) + .9 * g, f / max(s, .5)));
                    p = f;
                    d = b;
                }
                t += b;
            }
        }
        if (k > 3) {
            n = normalize(n);
            w = pow(ALBEDO, vec3(2.2)) * (mix(vec3(.16, .13, .12), vec3(.34, .38, .46), .5 + .5 * dot(n, m[1]))
                + max(dot(n, l), 0.) * vec3(1.05, 1, .95)) + .14 * pow(max(dot(reflect(v, n), l), 0.), 48.);
            e = max(w - .6, 0.);
            w += e / (1. + 2. * e) - e;
        }
        o += vec4(w, 1);
    }
    o = pow(o / o.a, vec4(.4545));
}
