uniform bool plain; // leaves the model's colours out
// base_colour(): sRGB, of the surface at p, model space.
vec3 base_colour(vec3 p) {
    return plain ? vec3(0.80, 0.74, 0.66) : albedo(p);
}
