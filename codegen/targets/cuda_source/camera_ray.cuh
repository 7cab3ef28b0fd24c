// camera_ray(): direction, length 1, model space, of the ray through the centre of a pixel; origin bottom left.
__device__ inline vec3 camera_ray(const Settings &s, int pixel) {
    float x = static_cast<float>(2 * (pixel % s.width) + 1 - s.width) / static_cast<float>(s.height);
    float y = static_cast<float>(2 * (pixel / s.width) + 1 - s.height) / static_cast<float>(s.height);
    return normalize(rotate(s.camera, vec3(x, y, -s.focal)));
}
