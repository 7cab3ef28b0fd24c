#include "march.cuh"
#include "shade.cuh"
// Variant `simple`: one thread per ray, float32; main.glsl in CUDA.
__global__ void render_simple(Settings s, vec4 *image) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    if (pixel >= s.pixels()) return;
    vec3 direction = camera_ray(s, pixel);
    Hit ray = march(s, direction);
    vec4 colour = plain(s, pixel, ray);
    if (ray.hit && shades_hits(s)) {
        vec3 p = s.camera.d.xyz + ray.t * direction;
        colour = shade(s, direction, ray.t, field_gradient(p, s.normal_level).xyz, albedo(p));
    }
    image[pixel] = colour;
}
