// Distances t, h at which the ray from 3.52 * m[2] along v enters and leaves the ball of radius 1.02; see shadertoy.glsl.
b = -3.52 * dot(m[2], v);
h = sqrt(max(b * b - 11.35, 0.));
t = b - h;
h += b;
