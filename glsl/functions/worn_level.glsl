uniform float split; // share of the width, from the left, with the traced level's own normals
// worn_level(): level whose gradient is the normal of a pixel; pixel: pixels, origin bottom left.
int worn_level(vec2 pixel) {
    return pixel.x < split * resolution.x ? level : normal_level;
}
