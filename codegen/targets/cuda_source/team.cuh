#include "packed.cuh"
// team.cuh: a team evaluates a network at points, one per lane. A team is one warp, or all warps of a block. Warps alone
// have 32 points each, for many rays; they evaluate the same layer at the same time, for which the weights are copied
// once per block, since L2 cannot supply every warp. The warps of a block together have the same 16 points, in their
// first lanes, and each works on every eighth group of 16 columns: less time per evaluation, which counts for few rays.
template <class Net> struct Tile {
    static constexpr int K = Net::WIDTH / 16;
    static constexpr int T = Net::WIDTH <= 256 ? 2 : 1;
    static constexpr int WORDS = (Net::SPLIT ? 2 : 1) * T * K;  // uint4 of shared memory per lane
    static constexpr int CHUNK = (Net::SPLIT ? 2 : 1) * 32 * K;  // uint4: weights of 16 columns
};

template <int LEVEL> constexpr int most(int words, int chunk) {
    using Net = NetworkOf<LEVEL>;
    int own = Tile<Net>::WORDS * words + Tile<Net>::CHUNK * chunk, finer = 0;
    if constexpr (LEVEL < LEVELS) finer = most<LEVEL + 1>(words, chunk);
    return own > finer ? own : finer;
}

constexpr int WORDS = most<1 - TEXTURED>(1, 0), CHUNK = most<1 - TEXTURED>(0, 1);
constexpr int CHUNKS = 3;  // in shared memory: one that is in use, and two that are on their way

__device__ inline int lane() { return static_cast<int>(threadIdx.x % 32u); }

template <int SIZE, int TEAMS> struct TeamOf {
    static constexpr int WARPS = SIZE;
    static constexpr int BLOCK = 32 * WARPS * TEAMS;  // threads
    static constexpr int POINTS = WARPS == 1 ? 32 : 16;
    // Shared memory of a block, in uint4: words of the teams' lanes, one for each thread to exchange values, and chunks.
    static constexpr int EXCHANGE = TEAMS * 32 * WORDS, FIRST_CHUNK = EXCHANGE + BLOCK;
    static constexpr int SHARED = (FIRST_CHUNK + (WARPS == 1 ? CHUNKS * CHUNK : 0)) * static_cast<int>(sizeof(uint4));

    __device__ static int first() { return WARPS == 1 ? 0 : static_cast<int>(threadIdx.x / 32u); }
    __device__ static bool leads() { return first() == 0; }

    // This lane's words of shared memory, at 0, 32, 64, ... from here.
    __device__ static uint4 *scratch() {
        return shared_memory() + (WARPS == 1 ? static_cast<int>(threadIdx.x / 32u) * 32 * WORDS : 0) + lane();
    }
    template <class T> __device__ static T *exchange() { return reinterpret_cast<T *>(shared_memory() + EXCHANGE); }
    __device__ static uint4 *chunk(int number) { return shared_memory() + FIRST_CHUNK + number % CHUNKS * CHUNK; }

    __device__ static void meet() {
        if constexpr (WARPS > 1) __syncthreads();
    }

    // Whether a warp of the block votes for what all of them have to do at once. vote: the same in all lanes.
    __device__ static bool any(bool vote) {
        if constexpr (WARPS > 1) return vote;
        return __syncthreads_or(vote) != 0;
    }

    // Sums values over the warps, in the same order for all, so that all have the same sums.
    template <int COUNT> __device__ static void add(float (&values)[COUNT]) {
        if constexpr (WARPS > 1) {
            float *told = exchange<float>();
#pragma unroll
            for (int c = 0; c < COUNT; ++c) told[c * BLOCK + static_cast<int>(threadIdx.x)] = values[c];
            meet();
#pragma unroll
            for (int c = 0; c < COUNT; ++c) {
                values[c] = 0.0f;
                for (int warp = 0; warp < WARPS; ++warp) values[c] += told[c * BLOCK + 32 * warp + lane()];
            }
            meet();
        }
    }
};

using Alone = TeamOf<1, THREADS / 32>;
using Together = TeamOf<8, 1>;
