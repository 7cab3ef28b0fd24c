uniform bool plain; // omits the model's colors
// base_color(): color of the surface at p, model space; sRGB.
vec3 base_color(vec3 p) {
    return plain ? vec3(0.80, 0.74, 0.66) : albedo(p);
}
