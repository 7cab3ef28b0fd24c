#include "camera_ray.glsl"
// settings.cuh: the settings of a picture (the uniforms of the GLSL targets by name), and derived values. Pixels are
// counted row by row from the bottom left.
struct Settings : Uniforms {
    __host__ __device__ int width() const { return static_cast<int>(resolution.x); }
    __host__ __device__ int height() const { return static_cast<int>(resolution.y); }
    __host__ __device__ int pixels() const { return width() * height(); }
    // Width of a pixel at distance 1 from the eye.
    __device__ float footprint() const { return 2.0f / (focal * resolution.y); }
    __device__ vec3 eye() const { return camera[3].xyz; }
    // Center of a pixel, in pixels from the bottom left.
    __device__ vec2 center(int pixel) const {
        return vec2(static_cast<float>(pixel % width()) + 0.5f, static_cast<float>(pixel / width()) + 0.5f);
    }
    // Direction of the ray through a pixel's center: length 1, model space.
    __device__ vec3 direction(int pixel) const { return camera_ray(center(pixel), resolution, camera, focal); }
};
