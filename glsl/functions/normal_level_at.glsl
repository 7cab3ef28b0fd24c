uniform float split; // share of the width, from the left, with the traced level's own normals
// normal_level_at(): level whose gradient is the normal of a pixel; pixel: pixels, origin bottom left.
int normal_level_at(vec2 pixel) {
    return pixel.x < split * resolution.x ? level : normal_level;
}
