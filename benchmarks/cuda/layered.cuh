// layered.cuh: the kernels of `layered`, which works like the paper's renderer. In every step, every layer of every
// network is one matrix product by cuBLAS over all pixels, including finished rays. The inputs of the products are
// halves, except in the first and last layer. Its schedule is plain.
namespace mplicits {

// Sines of sums [pixels][width] + bias, as halves or, with `floats` (the last layer), as floats; with `slopes` also
// their cosines as halves. A thread works on two columns. floats may be the array sums.
__global__ void activate_layered(const float *sums, const float *bias, int width, long long count, unsigned *halves,
                                 float *floats, unsigned *slopes) {
    long long i = 2 * (static_cast<long long>(blockIdx.x) * blockDim.x + threadIdx.x);
    if (i >= count) return;
    int column = static_cast<int>(i % width);
    float a0 = sums[i] + bias[column], a1 = sums[i + 1] + bias[column + 1];
    if (floats != nullptr) {
        floats[i] = __sinf(a0);
        floats[i + 1] = __sinf(a1);
    } else {
        halves[i / 2] = pack(__sinf(a0), __sinf(a1));
    }
    if (slopes != nullptr) slopes[i / 2] = pack(__cosf(a0), __cosf(a1));
}

// g = lift * adjoint * slope, as halves or, with `floats`, as floats. adjoint: [pixels][width], or one row for all
// pixels.
__global__ void scale_adjoint(const float *adjoint, bool row, float lift, const unsigned *slopes, int width,
                              long long count, unsigned *halves, float *floats) {
    long long i = 2 * (static_cast<long long>(blockIdx.x) * blockDim.x + threadIdx.x);
    if (i >= count) return;
    long long from = row ? i % width : i;
    float c0, c1;
    unpack(slopes[i / 2], c0, c1);
    float g0 = lift * adjoint[from] * c0, g1 = lift * adjoint[from + 1] * c1;
    if (floats != nullptr) {
        floats[i] = g0;
        floats[i + 1] = g1;
    } else {
        halves[i / 2] = pack(g0, g1);
    }
}

__global__ void enter_layered(Settings s, Hit *state) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    if (pixel < s.pixels()) state[pixel] = start_ray(s, s.direction(pixel));
}

__global__ void place(Settings s, const Hit *state, float4 *points) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    if (pixel >= s.pixels()) return;
    vec3 p = s.eye() + state[pixel].t * s.direction(pixel);
    points[pixel] = float4{p.x, p.y, p.z, MOVING ? time : 1.0f};
}

// Scale and offset of the output of a level's network.
template <int LEVEL = 1> __device__ inline vec2 affine(int level) {
    if constexpr (LEVEL < LEVELS) {
        if (level > LEVEL) return affine<LEVEL + 1>(level);
    }
    return vec2(NetworkOf<LEVEL>::scale(0), NetworkOf<LEVEL>::offset(0));
}

// One step of the rays at level `phase`. values: [LEVELS][pixels][8] sums of the output rows; active: counter of the
// unfinished rays, or null.
__global__ void step_layered(Settings s, int phase, const float *values, Hit *state, int *active) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    if (pixel >= s.pixels()) return;
    Hit ray = state[pixel];
    if (ray.level == phase) {
        auto value = [&](int level) {
            const float *of_level = values + static_cast<long long>(level - 1) * s.pixels() * 8;
            vec2 to = affine(level);
            return to.x * of_level[8LL * pixel] + to.y;
        };
        float f = value(1);
        int reached = 1;
        while (reached < phase && abs(f) < delta[reached - 1]) f += value(++reached);
        plain_step(ray, f, reached, s, exit_distance(s, s.direction(pixel)));
        state[pixel] = ray;
    }
    if (active != nullptr && ray.level > 0) atomicAdd(active, 1);
}

// Adds the gradient of a level, which is multiplied by lift, to those of the levels before.
__global__ void add_gradient(const float4 *of_level, int level, float lift, int pixels, vec3 *gradient) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    if (pixel >= pixels) return;
    vec3 added = affine(level).x / lift * vec3(of_level[pixel].x, of_level[pixel].y, of_level[pixel].z);
    gradient[pixel] = level == 1 ? added : gradient[pixel] + added;
}

__global__ void shade_layered(Settings s, const Hit *state, const vec3 *gradient, const float *colors, vec4 *image) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    if (pixel >= s.pixels()) return;
    Hit ray = state[pixel];
    vec4 color = plain(s, pixel, ray);
    if (ray.hit && shades_hits(s)) {
        vec3 direction = s.direction(pixel);
#if TEXTURED
        float c[3];
        for (int i = 0; i < 3; ++i) c[i] = NetworkOf<0>::scale(i) * colors[8LL * pixel + i] + NetworkOf<0>::offset(i);
        vec3 surface = clamp(vec3(c[0], c[1], c[2]), 0.0f, 1.0f);
#else
        (void)colors;
        vec3 surface = albedo(s.eye() + ray.t * direction);
#endif
        color = surface_color(s, direction, ray.t, gradient[pixel], surface);
    }
    image[pixel] = color;
}

}  // namespace mplicits
