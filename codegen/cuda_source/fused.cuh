#include "march.cuh"
#include "shade.cuh"
#include "adjoint.cuh"
#include "queues.cuh"
// Variant `fused`: the same march, but a warp holds 32 rays of one level and evaluates them together on the tensor
// cores. Kernels in order: enter; then per round and level trace; paint; shade_hits.

constexpr int REFILL = 8;  // lanes without a ray at which a warp takes new ones

// The field's fourth coordinate.
__device__ inline float fourth() { return MOVING ? time : 1.0f; }

__global__ void enter(Settings s, Rays rays) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    bool inside = pixel < s.pixels();
    Hit ray = {};
    if (inside) {
        float far;
        ray = start(s, camera_ray(s, pixel), far);
        rays.state[pixel] = ray;
    }
    append(inside && ray.level > 0, pixel, rays.list(0, 1), rays.length(0, 1));
}

// The values of levels LEVEL up to PHASE on top of f, for lanes whose point lies in the bands (Eq. 3).
// evaluated, asked: counts of lanes per network.
template <int LEVEL, int PHASE>
__device__ inline void finer(const PackedNetworks &networks, bool live, vec4 p, float &f, int &reached,
                             unsigned (&evaluated)[PHASE], unsigned (&asked)[PHASE]) {
    if constexpr (LEVEL <= PHASE) {
        bool inside = live && reached == LEVEL - 1 && abs(f) < delta[LEVEL - 2];
        unsigned voters = __ballot_sync(WARP, inside);
        if (voters == 0) return;
        evaluated[LEVEL - 1] += static_cast<unsigned>(__popc(voters));
        asked[LEVEL - 1] += 32;
        float residual[1];
        evaluate<NetworkOf<LEVEL>>(networks.of[LEVEL], p, residual);
        if (inside) {
            f += residual[0];
            reached = LEVEL;
        }
        finer<LEVEL + 1, PHASE>(networks, live, p, f, reached, evaluated, asked);
    }
}

// Up to iterations[PHASE - 1] steps of each ray that is at level PHASE. A warp keeps its lanes filled from the queue.
template <int PHASE>
__global__ void __launch_bounds__(THREADS) trace(Settings s, PackedNetworks networks, Rays rays, int round) {
    const int count = *rays.length(round, PHASE);
    const int *queue = rays.list(round, PHASE);
    unsigned evaluated[PHASE] = {}, asked[PHASE] = {};
    vec3 eye = s.camera.d.xyz, direction = vec3(0.0f, 0.0f, 1.0f);
    Hit ray = {};
    int pixel = 0, step = 0;
    float far = 0.0f;
    bool live = false, more = true;
    while (true) {
        unsigned idle = __ballot_sync(WARP, !live);
        if (more && __popc(idle) >= REFILL) {
            int first = 0;
            if (lane() == 0) first = atomicAdd(rays.taken + round * LEVELS + PHASE - 1, __popc(idle));
            first = __shfl_sync(WARP, first, 0);
            int mine = first + __popc(idle & ((1u << lane()) - 1u));
            if (!live && mine < count) {
                pixel = queue[mine];
                ray = rays.state[pixel];
                direction = camera_ray(s, pixel);
                far = ball(eye, direction, 1.0f + delta[s.level - 1]).exit;
                step = 0;
                live = true;
            }
            more = first + __popc(idle) < count;
            idle = __ballot_sync(WARP, !live);
        }
        if (idle == WARP) {
            if (more) continue;
            break;
        }
        vec4 p = vec4(eye + ray.t * direction, fourth());
        float value[1];
        evaluate<NetworkOf<1>>(networks.of[1], p, value);
        evaluated[0] += static_cast<unsigned>(__popc(~idle));
        asked[0] += 32;
        int reached = 1;
        finer<2, PHASE>(networks, live, p, value[0], reached, evaluated, asked);
        bool leaves = false;
        if (live) {
            advance(ray, value[0], reached, s, far);
            leaves = ray.level != PHASE || ++step == iterations[PHASE - 1];
            if (leaves) rays.state[pixel] = ray;
            live = !leaves;
        }
        if (__any_sync(WARP, leaves)) hand_over(rays, leaves, ray, pixel, round, PHASE, round + 1 == s.rounds);
    }
    if (lane() == 0) {
#pragma unroll
        for (int i = 0; i < PHASE; ++i) {
            if (asked[i] == 0) continue;
            atomicAdd(rays.work + i, static_cast<unsigned long long>(evaluated[i]));
            atomicAdd(rays.work + LEVELS + i, static_cast<unsigned long long>(asked[i]));
        }
    }
}

// Every pixel without its surface.
__global__ void paint(Settings s, const Hit *state, vec4 *image) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    if (pixel < s.pixels()) image[pixel] = plain(s, pixel, state[pixel]);
}

// The sum of the levels' gradients up to the normal level.
template <int LEVEL> __device__ inline vec3 gradient_to(const PackedNetworks &networks, const Settings &s, vec4 p) {
    vec3 gradient = evaluate_gradient<NetworkOf<LEVEL>>(networks.of[LEVEL], p);
    if constexpr (LEVEL < LEVELS) {
        if (s.normal_level > LEVEL) gradient = gradient + gradient_to<LEVEL + 1>(networks, s, p);
    }
    return gradient;
}

__device__ inline vec3 tile_albedo(const PackedNetworks &networks, vec4 p) {
#if TEXTURED
    float c[3];
    evaluate<NetworkOf<0>>(networks.of[0], p, c);
    return clamp(vec3(c[0], c[1], c[2]), 0.0f, 1.0f);
#else
    (void)networks;
    return albedo(p.xyz);
#endif
}

// The pixels on the surface, 32 to a warp.
__global__ void __launch_bounds__(THREADS) shade_hits(Settings s, PackedNetworks networks, Rays rays, vec4 *image) {
    const int count = *rays.hit_count;
    const int warps = static_cast<int>(gridDim.x * blockDim.x / 32u);
    for (int tile = static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / 32u); 32 * tile < count; tile += warps) {
        int place = 32 * tile + lane(), pixel = rays.hits[place < count ? place : 32 * tile];
        vec3 direction = camera_ray(s, pixel);
        float t = rays.state[pixel].t;
        vec4 p = vec4(s.camera.d.xyz + t * direction, fourth());
        vec3 gradient = gradient_to<1>(networks, s, p), colour = tile_albedo(networks, p);
        if (place < count) image[pixel] = shade(s, direction, t, gradient, colour);
    }
}
