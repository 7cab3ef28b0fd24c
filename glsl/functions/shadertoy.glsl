// mainImage(): main.glsl in few characters, for Shadertoy's Image tab: the same camera and light, a slow turntable, and
// orbiting by drags. Shadertoy reports only the current drag (button down position, last position): a drag adds to the
// turn, and the next drag starts without it.
// The field's text must appear once and be called at one place: the loop traces the ray (tap -1), then takes four samples
// around the surface for the normal (taps 0 to 3). Loops that begin at min(iFrame, 0) are not unrolled.
// o: color; q: pixel; r: resolution; z: the smaller side; a: azimuth, elevation; m: camera, columns right, up, back;
// j: sample; u: its point of the image; v, l: directions of the ray and to the light; n: normal; e: offset of a tap, later
// the color's excess over .6; w: color of a sample, linear light; t: distance along the ray; h: distance at which it leaves
// the shape's ball or hull, whose text replaces ENTER.
// Steps are as in march.glsl: p: radius of the last free sphere, 0: none; d: distance from its center; s: slope; g: allowed
// gap; b: the step (tests/oracles/short_march.py).
// SOFTBOX: softbox.glsl and floor_color.glsl in few characters; short texts omit them. A ray that misses continues to the
// floor (h is 0 then). Then follow openness.glsl's samples of level 1 from the ray's end point: tap 4 at the point, 5 to 9
// for the sky, from 10 on toward the light. W: their distance from the point; x: their position; g: its distance from the
// origin. A: occlusion of the sky, later its visible share; C: cover, later the light's visible share; F: `here`; p and S:
// the last two steps; d, s: ratio and rise of the previous sample. G: height of the floor; Y: half-width of level 1's band.
void mainImage(out vec4 o, vec2 q) {
    vec2 r = iResolution.xy, u;
    float z = min(r.x, r.y);
    vec2 a = radians(VIEW) + vec2(SPEED * iTime, 0) - 3.14 * (iMouse.xy - abs(iMouse.zw)) / z, s, c;
    a.y = clamp(a.y, -1.4, 1.4);
    s = sin(a);
    c = cos(a);
    mat3 m = mat3(c.x, 0, -s.x, -s.y * s.x, c.y, -s.y * c.x, c.y * s.x, s.y, c.y * c.x);
    vec3 l = m * normalize(LIGHT);
#ifdef SOFTBOX
    if (SOFTBOX > 0) {
        l = normalize(LIGHT);
        l = normalize(vec3(l.x * c.x + l.z * s.x, max(l.y, .35), l.z * c.x - l.x * s.x));
    }
#endif
    o = vec4(0);
    for (int j = min(iFrame, 0); j < AA * AA; j++) {
        u = q + (vec2(j % AA, j / AA) + .5) / float(AA) - .5;
        vec3 v = normalize(m * vec3((2. * u - r) / z, -3.17)), n = vec3(0), e, w = pow(mix(BOTTOM, TOP, u.y / r.y), vec3(2.2));
        float t = 0., h, p = 0., d = 1., s, f, g, b;
        ENTER
        k = -1;
#ifdef SOFTBOX
        float A = -1., C = 1., F = 0., W, S;
        for (int i = min(iFrame, 0); i < STEPS && k < 4 + 26 * SOFTBOX; i++) {
            if (k < 0 && t >= h) {
                t = (G - 3.52 * m[2].y) / v.y;
                if (SOFTBOX < 1 || t < 0.) break;
                n.y = 1.;
                h = A = 0.;
                e = 3.52 * m[2] + t * v + .7 * n;
                k = length(e) < 1.7 ? 5 : 10;
            }
            vec3 x = 3.52 * m[2] + t * v;
            if (k < 10) W = k < 4 ? .002 : .028 * float((k - 4) * (k - 4));
#else
        for (int i = min(iFrame, 0); i < STEPS && k < 4 && t < h; i++) {
#endif
            e = k < 0 ? vec3(0) : vec3(k + 3 >> 1 & 1, k >> 1 & 1, k & 1) - .5;
#ifdef SOFTBOX
            if (k > 3) {
                n = normalize(n);
                e = k < 10 ? n : l;
                if (k == 10) {
                    b = -dot(x, l);
                    f = dot(x, x) - b * b;
                    if (dot(n, l) < -.16 || f > pow(1. + .16 * max(b, 0.), 2.)) break;
                    W = max(.03, b - sqrt(max(1. - f, .1)));
                    d = -9.;
                    s = 0.;
                    p = 1.;
                }
            }
            x += W * e;
            g = k < 4 ? 1. : max(length(x), 1.);
            if (k > 9 && length(x) > 1. + .16 * W * C && dot(x, l) > 0.) break;
            f = field(vec4(x / g, 1));
            if (k > 3) {
                if (g > 1.) f = length(vec2(g - 1., max(f, 0.)));
                if (k == 4) F = f;
                f -= F * max(1. - 4. * W, 0.);
                if (k < 10) A += (1.48 - .12 * float(k)) * clamp(1. - min(f, x.y - G) / max(W, .001), 0., 1.5);
                else {
                    g = f / (.16 * W);
                    C = min(C, g);
                    b = (g - d) / p;
                    e.x = s * p + b * S;
                    if (s < 0. && b > 0.) C = min(C, d - .25 * e.x * e.x / (S + p) / (b - s));
                    if (C < -1.) break;
                    s = b;
                    d = g;
                    S = p;
                    W += p = max(abs(f) * clamp(.55 + .15 * g, .7, 1.), .02 + .12 * W);
                }
                k++;
            }
            else if (k >= 0) { n += f * e; k++; }
#else
            f = field(vec4(3.52 * m[2] + t * v + .002 * e, 1));
            if (k >= 0) { n += f * e; k++; }
#endif
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
#ifdef SOFTBOX
        A = clamp(1. - A / 3.2, 0., 1.);
        C = clamp(C, -1., 1.);
        C = .25 * (1. + C) * (1. + C) * (2. - C);
        b = 3.52 * m[2].y - G;
        if (k > 3 && h == 0.) {
            e = 3.52 * m[2] + t * v;
            g = dot(e, e) / 2.5;
            f = (.9 * l.y * C + .45 * A) / (.9 * l.y + .45);
            w *= mix(1., f + 1.4 * f * (1. - smoothstep(.05, .5, dot(w, vec3(.333)))) / (1. + g * g), smoothstep(0., .3, b));
        } else
#endif
        if (k > 3) {
            n = normalize(n);
            e = reflect(v, n);
            g = dot(n, l);
            w = pow(ALBEDO, vec3(2.2));
#ifdef SOFTBOX
            if (SOFTBOX > 0) {
                f = A * clamp(1. + .6 * F / Y, .5, 1.);
                s = clamp(g + .2, 0., .4);
                w *= mix(sqrt(f) * (1. - .75 / (1. + 4. * max(b + t * v.y, 0.))) * vec3(.3, .28, .26),
                    f * vec3(.4, .43, .48), smoothstep(-1., 1., n.y)) + .86 * C * max(g, 1.25 * s * s) * vec3(1, .97, .92);
                w += .9 * f * (.04 + .5 * pow(1. - max(-dot(n, v), 0.), 5.)) * smoothstep(-.2, .9, e.y)
                    + .1 * C * pow(max(dot(e, l), 0.), 40.);
            } else
#endif
            w = w * (mix(vec3(.16, .13, .12), vec3(.34, .38, .46), .5 + .5 * dot(n, m[1])) + max(g, 0.) * vec3(1.05, 1, .95))
                + .14 * pow(max(dot(e, l), 0.), 48.);
            e = max(w - .6, 0.);
            w += e / (1. + 2. * e) - e;
        }
        o += vec4(w, 1);
    }
    o = pow(o / o.a, vec4(.4545));
}
