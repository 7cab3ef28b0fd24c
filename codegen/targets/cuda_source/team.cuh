#include "packed.cuh"
// team.cuh: a team evaluates a network at 32 points, one per lane. A team is one warp, or all warps of a block, which
// hold the same rays and each work on every fourth group of 16 columns. Single warps are for many rays. A block takes a
// fourth of the time per evaluation, which counts for few rays.
template <class Net> struct Tile {
    static constexpr int K = Net::WIDTH / 16;
    static constexpr int T = Net::WIDTH <= 256 ? 2 : 1;
    static constexpr int WORDS = (Net::SPLIT ? 2 : 1) * T * K;  // uint4 of shared memory per lane
};

template <int LEVEL> constexpr int most_words() {
    int finer = 0;
    if constexpr (LEVEL < LEVELS) finer = most_words<LEVEL + 1>();
    return Tile<NetworkOf<LEVEL>>::WORDS > finer ? Tile<NetworkOf<LEVEL>>::WORDS : finer;
}

constexpr int WORDS = most_words<1 - TEXTURED>();

__device__ inline int lane() { return static_cast<int>(threadIdx.x % 32u); }

template <int SIZE> struct TeamOf {
    static constexpr int WARPS = SIZE;
    static constexpr int TEAMS = THREADS / 32 / WARPS;  // per block
    // Bytes of a block's shared memory: the words of the teams' lanes, then up to 3 floats per lane that the warps of a
    // team exchange.
    static constexpr int TOLD = WARPS > 1 ? 3 * THREADS * static_cast<int>(sizeof(float)) : 0;
    static constexpr int SHARED = TEAMS * 32 * WORDS * static_cast<int>(sizeof(uint4)) + TOLD;

    __device__ static int first() { return WARPS == 1 ? 0 : static_cast<int>(threadIdx.x / 32u); }
    __device__ static bool leads() { return first() == 0; }

    // This lane's words of shared memory, at 0, 32, 64, ... from here.
    __device__ static uint4 *scratch() {
        return shared_memory() + (WARPS == 1 ? static_cast<int>(threadIdx.x / 32u) * 32 * WORDS : 0) + lane();
    }

    __device__ static void meet() {
        if constexpr (WARPS > 1) __syncthreads();
    }

    // Sums values over the warps, in the same order for all, so that all have the same sums.
    template <int COUNT> __device__ static void add(float (&values)[COUNT]) {
        if constexpr (WARPS > 1) {
            float *told = told_floats();
#pragma unroll
            for (int c = 0; c < COUNT; ++c) told[c * THREADS + static_cast<int>(threadIdx.x)] = values[c];
            meet();
#pragma unroll
            for (int c = 0; c < COUNT; ++c) {
                values[c] = 0.0f;
                for (int warp = 0; warp < WARPS; ++warp) values[c] += told[c * THREADS + 32 * warp + lane()];
            }
            meet();
        }
    }

    // One atomicAdd() for the team; all lanes get the old value.
    __device__ static int take(int *counter, int count) {
        int old = 0;
        if constexpr (WARPS == 1) {
            if (lane() == 0) old = atomicAdd(counter, count);
            return __shfl_sync(WARP, old, 0);
        } else {
            int *told = reinterpret_cast<int *>(told_floats());
            if (threadIdx.x == 0) *told = atomicAdd(counter, count);
            meet();
            old = *told;
            meet();
            return old;
        }
    }

private:
    __device__ static float *told_floats() {
        return reinterpret_cast<float *>(shared_memory() + TEAMS * 32 * WORDS);
    }
};

using Alone = TeamOf<1>;
using Together = TeamOf<THREADS / 32>;
static_assert(Together::SHARED <= Alone::SHARED, "a launch with room for warps alone has room for a team of them");
