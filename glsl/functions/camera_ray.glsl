// camera_ray(): direction of the ray through a point of the image; length 1, model space.
// pixel, resolution: pixels, origin bottom left; camera: columns right, up, back, eye; focal: 1 / tan(fov / 2), vertical.
vec3 camera_ray(vec2 pixel, vec2 resolution, mat4 camera, float focal) {
    vec2 plane = (2.0 * pixel - resolution) / resolution.y;
    return normalize(mat3(camera) * vec3(plane, -focal));
}
