#include "stepping.cuh"
#include "colors.cuh"
#include "adjoint.cuh"
#include "queues.cuh"
// fused.cuh: variant `fused`. Its rays march like those of `simple`, but a team evaluates 32 of them together on the
// tensor cores. The kernels in order: enter; trace, for each level of the first rounds; finish; paint; shade_hits.

constexpr int REFILL = 32;  // a block takes new rays when this many of its threads have none

// The fourth input of the networks.
__device__ inline float fourth() { return MOVING ? time : 1.0f; }

__global__ void enter(Settings s, Rays rays) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    bool inside = pixel < s.pixels(), relaxed = s.schedule == SCHEDULE_RELAXED;
    Hit ray = {};
    if (inside) {
        vec3 direction = s.direction(pixel);
        ray = start_ray(s, direction);
        Past past = {};
        if (relaxed && s.rounds > 0) skip_cells(ray, past, s, direction, exit_distance(s, direction));
        rays.state[pixel] = ray;
        rays.past[pixel] = past;
    }
    int phase = relaxed ? s.level : 1;
    append(inside && ray.level > 0, pixel, rays.list(0, phase), rays.length(0, phase));
}

// Counts the points at which each network was evaluated, and the lanes that took part, with or without a ray.
struct Work {
    unsigned evaluated[LEVELS] = {}, lanes_used[LEVELS] = {};

    __device__ void count(int level, unsigned lanes) {
        evaluated[level - 1] += static_cast<unsigned>(__popc(lanes));
        lanes_used[level - 1] += lanes ? 32 : 0;
    }
    __device__ void write(unsigned long long *work) const {
#pragma unroll
        for (int i = 0; i < LEVELS; ++i) {
            if (lanes_used[i] == 0) continue;
            atomicAdd(work + i, static_cast<unsigned long long>(evaluated[i]));
            atomicAdd(work + LEVELS + i, static_cast<unsigned long long>(lanes_used[i]));
        }
    }
};

// Adds the residuals of levels LEVEL to LAST to f in lanes whose point is in the bands (Eq. 3), up to each lane's own
// level.
template <int LEVEL, int LAST, class Team>
__device__ inline void finer(const PackedNetworks &networks, int own, vec4 p, float &f, int &reached, Work &work) {
    if constexpr (LEVEL <= LAST) {
        bool inside = own >= LEVEL && reached == LEVEL - 1 && abs(f) < delta[LEVEL - 2];
        unsigned voters = __ballot_sync(WARP, inside);
        if (!Team::any(voters != 0)) return;
        work.count(LEVEL, voters);
        float residual[1];
        evaluate<NetworkOf<LEVEL>, Team>(networks.of[LEVEL], p, residual, voters != 0);
        if (inside) {
            f += residual[0];
            reached = LEVEL;
        }
        finer<LEVEL + 1, LAST, Team>(networks, own, p, f, reached, work);
    }
}

// The field at p for rays of levels up to LAST. own: the level of this lane's ray; 0 without a ray. Away from the
// surface, where level 1 only gives the distance to its band, it may be inexact.
template <int LAST, class Team>
__device__ inline float value_of(const PackedNetworks &networks, const Settings &s, int own, vec4 p, int &reached,
                                 Work &work) {
    float value[1];
    unsigned lanes = __ballot_sync(WARP, own > 0);
    if (LAST == 1 && s.level > 1) {
        evaluate<Rough<NetworkOf<1>>, Team>(networks.of[1], p, value, lanes != 0);
    } else {
        evaluate<NetworkOf<1>, Team>(networks.of[1], p, value, lanes != 0);
    }
    work.count(1, lanes);
    reached = 1;
    finer<2, LAST, Team>(networks, own, p, value[0], reached, work);
    return value[0];
}

// One atomicAdd() for the block; all threads get the old value.
template <class Team> __device__ inline int take(int *counter, int count) {
    int *told = Team::template exchange<int>();
    __syncthreads();
    if (threadIdx.x == 0) *told = atomicAdd(counter, count);
    __syncthreads();
    int old = *told;
    __syncthreads();
    return old;
}

// The number of threads of this block, before this one, whose vote is true; all: of the whole block.
__device__ inline int rank(bool vote, int &all) {
    int *counts = Alone::exchange<int>(), warp = static_cast<int>(threadIdx.x / 32u), before = 0;
    unsigned voters = __ballot_sync(WARP, vote);
    __syncthreads();
    if (lane() == 0) counts[warp] = __popc(voters);
    __syncthreads();
    all = 0;
    for (int i = 0; i < THREADS / 32; ++i) {
        before += i < warp ? counts[i] : 0;
        all += counts[i];
    }
    return before + __popc(voters & ((1u << lane()) - 1u));
}

// Takes up to iterations[PHASE - 1] steps of each ray that waits for this phase. A thread has a ray, or waits for one; the
// points of a block's rays are moved together, so that as few warps as possible evaluate them.
template <int PHASE>
__global__ void __launch_bounds__(THREADS) trace(Settings s, PackedNetworks networks, Rays rays, int round) {
    const int count = *rays.length(round, PHASE), thread = static_cast<int>(threadIdx.x);
    const int *queue = rays.list(round, PHASE);
    vec4 *exchange = Alone::exchange<vec4>();
    Work work;
    Hit ray = {};
    Past past = {};
    int pixel = 0, step = 0;
    bool live = false, more = true;
    while (true) {
        int all, place = rank(live, all), idle = THREADS - all;
        if (!live) place = all + thread - place;
        if (more && idle >= REFILL) {
            int first = take<Alone>(rays.taken + round * LEVELS + PHASE - 1, idle), left = first < count ? count - first : 0;
            if (!live && place - all < left) {
                pixel = queue[first + place - all];
                ray = rays.state[pixel];
                past = rays.past[pixel];
                step = 0;
                live = true;
            }
            more = idle < left;
            all += more ? idle : left;
        }
        if (all == 0) break;
        __syncthreads();
        if (live) exchange[place] = vec4(s.eye() + ray.t * s.direction(pixel), fourth());
        __syncthreads();
        int reached;
        vec4 p = exchange[thread < all ? thread : all - 1];
        float f = value_of<PHASE, Alone>(networks, s, thread < all ? PHASE : 0, p, reached, work);
        __syncthreads();
        exchange[thread] = vec4(vec3(f, static_cast<float>(reached), 0.0f), 0.0f);
        __syncthreads();
        bool leaves = false;
        int next = PHASE;
        if (live) {
            vec4 found = exchange[place];
            vec3 direction = s.direction(pixel);  // computed again: no register holds it meanwhile
            take_step(ray, past, found.xyz.x, static_cast<int>(found.xyz.y), s, direction, exit_distance(s, direction));
            next = next_phase(ray, s);
            leaves = next != PHASE || ++step == iterations[PHASE - 1];
            if (leaves) {
                rays.state[pixel] = ray;
                rays.past[pixel] = past;
            }
            live = !leaves;
        }
        if (__any_sync(WARP, leaves)) hand_over(rays, leaves, ray, next, pixel, round, PHASE, round + 1 == s.rounds);
    }
    if (lane() == 0) work.write(rays.work);
}

// Takes all steps of the rays that wait for `round`, at any level, in march()'s order. For the few rays that are left,
// every kernel of a phase would take as long as its slowest ray.
__global__ void __launch_bounds__(Together::BLOCK) finish(Settings s, PackedNetworks networks, Rays rays, int round) {
    const int count = rays.waiting_in(round);
    Work work;
    while (true) {
        int first = take<Together>(rays.taken + round * LEVELS, Together::POINTS);
        if (first >= count) break;
        int pixel = lane() < Together::POINTS ? rays.waiting_at(round, first + lane()) : -1;
        bool live = pixel >= 0;
        Hit ray = live ? rays.state[pixel] : Hit{};
        Past past = live ? rays.past[pixel] : Past{};
        int now = round, phase = next_phase(ray, s), step = 0;
        while (__any_sync(WARP, live)) {
            int reached;
            vec4 p = vec4(s.eye() + ray.t * s.direction(live ? pixel : 0), fourth());
            float f = value_of<LEVELS, Together>(networks, s, live ? phase : 0, p, reached, work);
            bool done = false;
            if (live) {
                vec3 direction = s.direction(pixel);
                take_step(ray, past, f, reached, s, direction, exit_distance(s, direction));
                int next = next_phase(ray, s);
                if (next != phase || ++step == iterations[phase - 1]) {
                    now += next <= phase;
                    phase = next;
                    step = 0;
                }
                done = phase <= 0 || now == s.rounds;
                live = !done;
            }
            if (!Together::leads() || !__any_sync(WARP, done)) continue;
            if (done) rays.state[pixel] = ray;
            append(done && ray.hit, pixel, rays.hits, rays.hit_count);
        }
    }
    if (Together::leads() && lane() == 0) work.write(rays.work);
}

// Colors every pixel as if no surface were there.
__global__ void paint(Settings s, const Hit *state, vec4 *image) {
    int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    if (pixel < s.pixels()) image[pixel] = plain(s, pixel, state[pixel]);
}

// The sum of the levels' gradients from LEVEL up to the normal level.
template <int LEVEL> __device__ inline vec3 gradient_to(const PackedNetworks &networks, const Settings &s, vec4 p) {
    vec3 gradient = evaluate_gradient<NetworkOf<LEVEL>>(networks.of[LEVEL], p);
    if constexpr (LEVEL < LEVELS) {
        if (s.normal_level > LEVEL) gradient = gradient + gradient_to<LEVEL + 1>(networks, s, p);
    }
    return gradient;
}

// Color, sRGB, of the surface at p, this lane's point.
__device__ inline vec3 tile_albedo(const PackedNetworks &networks, vec4 p) {
#if TEXTURED
    float c[3];
    evaluate<NetworkOf<0>, Alone>(networks.of[0], p, c);
    return clamp(vec3(c[0], c[1], c[2]), 0.0f, 1.0f);
#else
    (void)networks;
    return albedo(p.xyz);
#endif
}

// Colors the pixels on the surface, one per thread.
__global__ void __launch_bounds__(THREADS) shade_hits(Settings s, PackedNetworks networks, Rays rays, vec4 *image) {
    const int count = *rays.hit_count;
    for (int first = THREADS * static_cast<int>(blockIdx.x); first < count; first += THREADS * static_cast<int>(gridDim.x)) {
        int place = first + static_cast<int>(threadIdx.x), pixel = rays.hits[place < count ? place : first];
        vec3 direction = s.direction(pixel);
        float t = rays.state[pixel].t;
        vec4 p = vec4(s.eye() + t * direction, fourth());
        vec3 gradient = gradient_to<1>(networks, s, p), color = tile_albedo(networks, p);
        if (place < count) image[pixel] = surface_color(s, direction, t, gradient, color);
    }
}
