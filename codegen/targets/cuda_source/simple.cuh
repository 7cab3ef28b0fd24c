#include "grid.cuh"
#include "cells.glsl"
#include "half_width.glsl"
#include "march.glsl"
#include "colors.cuh"
// simple.cuh: variant `simple`, one thread for each ray, in float32: main.glsl as a kernel.
__global__ void render_simple(Settings s, vec4 *image) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    if (pixel >= s.pixels()) return;
    vec3 direction = s.direction(pixel);
    Hit ray = march(s.eye(), direction, s.footprint(), s.level, s.rounds, s.step_scale, s.schedule);
    vec4 color = plain(s, pixel, ray);
    if (ray.hit && shades_hits(s)) {
        vec3 p = s.eye() + ray.t * direction;
        color = surface_color(s, direction, ray.t, field_gradient(p, s.normal_level).xyz, albedo(p));
    }
    image[pixel] = color;
}
