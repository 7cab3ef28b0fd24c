#include "packed.cuh"
// team.cuh: who evaluates a network at 32 points, of which each lane has one. That is a warp alone, or the warps of a
// block together, where all warps hold the same rays and each works on every fourth group of 16 columns. Warps work
// alone where there are many rays. Together, one evaluation takes a fourth of the time, which counts where few are
// left.
template <class Net> struct Tile {
    static constexpr int K = Net::WIDTH / 16;
    static constexpr int T = Net::WIDTH <= 256 ? 2 : 1;
    static constexpr int WORDS = (Net::SPLIT ? 2 : 1) * T * K;  // uint4 of shared memory that a lane needs
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
    static constexpr int TEAMS = THREADS / 32 / WARPS;  // of a block
    // Bytes of a block's shared memory: the words of the teams' lanes, then what the warps of a team tell one another,
    // which is up to 3 floats a lane.
    static constexpr int TOLD = WARPS > 1 ? 3 * THREADS * static_cast<int>(sizeof(float)) : 0;
    static constexpr int SHARED = TEAMS * 32 * WORDS * static_cast<int>(sizeof(uint4)) + TOLD;

    __device__ static int first() { return WARPS == 1 ? 0 : static_cast<int>(threadIdx.x / 32u); }
    __device__ static bool leads() { return first() == 0; }

    // This lane's words of shared memory, which are those at 0, 32, 64, ... from here.
    __device__ static uint4 *scratch() {
        return shared_memory() + (WARPS == 1 ? static_cast<int>(threadIdx.x / 32u) * 32 * WORDS : 0) + lane();
    }

    __device__ static void meet() {
        if constexpr (WARPS > 1) __syncthreads();
    }

    // Sums values over the warps, in the warps' order, so that all get the same sums.
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

    // atomicAdd() once for the team, of which all lanes get the old value.
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
