// sine(), cosine(): of each component, radians, within 6e-7 for |x| < 1e4. sin() may be less accurate (2e-4 on SwiftShader;
// GLSL ES and D3D guarantee little). The argument is reduced to [-pi, pi] by subtracting 2 pi in two parts; the first,
// 6.28125, is exact when multiplied by a whole number below 2^16. Minimax polynomials.
vec4 reduced(vec4 x) {
    vec4 turns = round(x * 0.159154943);
    return (x - turns * 6.28125) - turns * 0.00193530718;
}

vec4 sine(vec4 x) {
    vec4 r = reduced(x);
    vec4 s = r * r;
    vec4 p = s * (s * (s * (s * 2.036623056e-8 - 2.699822784e-6) + 1.980874004e-4) - 8.332407594e-3) + 1.666655345e-1;
    return r * (0.9999996039 - s * p);
}

vec4 cosine(vec4 x) {
    vec4 r = reduced(x);
    vec4 s = r * r;
    vec4 p = s * (s * (s * 1.724760890e-9 - 2.707977564e-7) + 2.476996628e-5) - 1.388780784e-3;
    return s * (s * (s * p + 4.166649020e-2) - 0.4999998919) + 0.9999999892;
}
