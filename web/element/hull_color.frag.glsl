// The color of a model in a scene of three.js: Lambert's law with the scene's lights.
uniform vec3 plain; // color without a texture, as in the scene's working space
uniform bool linearized; // whether colors are linear
uniform vec3 toward[LIGHTS], shine[LIGHTS]; // directions to the lights, length 1, in the world, and their light
uniform vec3 ambient, overhead, sky, ground_light; // light from everywhere; and of a hemisphere: its axis, upper and lower light

vec3 from_srgb(vec3 c) {
    return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, lessThan(c, vec3(0.04045)));
}

void main() {
    vec3 p = traced_hull();
    vec3 normal = normalize(into_world * field_gradient(p, level).xyz);
    vec3 light = ambient + mix(ground_light, sky, 0.5 + 0.5 * dot(normal, overhead));
    for (int i = 0; i < LIGHTS; ++i) light += shine[i] * max(dot(normal, toward[i]), 0.0);
#ifdef TEXTURED
    vec3 base = albedo(p);
    if (linearized) base = from_srgb(base);
#else
    vec3 base = plain;
#endif
    gl_FragColor = vec4(base * light, 1.0);
    #include <tonemapping_fragment>
    OUTPUT_COLORS
}
