uniform float split; // share of the width, from the left, that wears the traced level's own normals
// normal_at(): the surface's normal at a point p, model space, which the ray of a pixel has met; length 1.
// pixel: pixels, origin bottom left.
vec3 normal_at(vec3 p, vec2 pixel) {
    return normalize(field_gradient(p, pixel.x < split * resolution.x ? level : normal_level).xyz);
}
