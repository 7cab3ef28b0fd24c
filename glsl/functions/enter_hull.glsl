// After enter_ball.glsl: clips the ray by thirteen pairs of planes. H: their offsets, two for each of the whole-number
// directions that field/hull.py counts. See shadertoy.glsl.
for (int i = 14; i < 27; i++) {
    e = vec3(i % 3, i / 3 % 3, i / 9) - 1.;
    u = (vec2(H[2 * i - 28], H[2 * i - 27]) - 3.52 * dot(m[2], e)) / (dot(v, e) + 1e-9);
    t = max(t, min(u.x, u.y));
    h = min(h, max(u.x, u.y));
}
