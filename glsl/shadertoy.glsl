// mainImage(): main.glsl in few characters, for Shadertoy's Image tab: the same camera and light, drag to orbit, a slow
// turntable otherwise. The field's text must stand here once and be called at one place: the loop traces the ray (tap
// -1), then takes four samples around the surface for the normal (tap 0 to 3).
// o: colour; q: pixel; r: resolution; a: azimuth, elevation; m: camera, columns right, up, back; v, l: directions of
// the ray and to the light; n: normal; e: offset of a tap; b, h: of the ball that the shape is in; t: along the ray.
void mainImage(out vec4 o, vec2 q) {
    vec2 r = iResolution.xy, a = iMouse.x > 0. ? 6.28 * iMouse.xy / r - vec2(3.14, 2.5) : vec2(.52 + .3 * iTime, .35), s = sin(a), c = cos(a);
    mat3 m = mat3(c.x, 0, -s.x, -s.y * s.x, c.y, -s.y * c.x, c.y * s.x, s.y, c.y * c.x);
    vec3 v = normalize(m * vec3((2. * q - r) / r.y, -3.17)), l = m * vec3(-.43, .6, .68), n = vec3(0), e;
    float b = 3.52 * dot(m[2], v), h = sqrt(max(b * b - 11.35, 0.)), t = -b - h, f;
    int k = -1;
    for (int i = min(iFrame, 0); i < 200 && k < 4 && t < h - b; i++) {
        e = k < 0 ? vec3(0) : vec3(k + 3 >> 1 & 1, k >> 1 & 1, k & 1) - .5;
        f = field(vec4(3.52 * m[2] + t * v + .002 * e, 1));
        if (k >= 0) { n += f * e; k++; }
        else if (abs(f) < .06 * t / r.y) k = 0;
        else t += STEP * f;
    }
    o = vec4(mix(vec3(.13, .14, .17), vec3(.33, .36, .41), q.y / r.y), 1);
    if (k > 3) {
        n = normalize(n);
        o.rgb = ALBEDO * (mix(vec3(.16, .13, .12), vec3(.34, .38, .46), .5 + .5 * dot(n, m[1]))
            + max(dot(n, l), 0.) * vec3(1.05, 1, .95)) + .14 * pow(max(dot(reflect(v, n), l), 0.), 48.);
        o = pow(o, vec4(.4545));
    }
}
