// queues.cuh: which rays are traced at which level, between the phases of `fused`.
// A ray that is not done waits in the queue of its level: this round's where that level's phase is still to come, else
// the next round's. Counters are per round and level, so that afterwards they are the statistics.
struct Rays {
    Hit *state;                // [pixels]
    int *queue[2];             // [LEVELS][pixels] each, by parity of the round
    int *hits;                 // [pixels], those done on the surface
    int *waiting;              // [rounds + 1][LEVELS]: length of the queue
    int *taken;                // [rounds + 1][LEVELS]: how many of it are taken
    int *hit_count;            // 1
    unsigned long long *work;  // [LEVELS] points evaluated by each network, then [LEVELS] lanes that were asked for
    int pixels;

    __device__ int *list(int round, int level) const { return queue[round % 2] + (level - 1) * pixels; }
    __device__ int *length(int round, int level) const { return waiting + round * LEVELS + level - 1; }

    // How many rays wait for a round, and the pixel of one of them, level after level; -1 beyond the last.
    __device__ int waiting_in(int round) const {
        int all = 0;
        for (int level = 1; level <= LEVELS; ++level) all += *length(round, level);
        return all;
    }
    __device__ int waiting_at(int round, int place) const {
        for (int level = 1; level <= LEVELS; ++level) {
            int count = *length(round, level);
            if (place < count) return list(round, level)[place];
            place -= count;
        }
        return -1;
    }
};

// Appends the pixels of the lanes that want it: one atomic for the warp, places by ballot.
__device__ inline void append(bool wanted, int pixel, int *list, int *length) {
    unsigned voters = __ballot_sync(WARP, wanted);
    if (voters == 0) return;
    int first = 0;
    if (lane() == 0) first = atomicAdd(length, __popc(voters));
    first = __shfl_sync(WARP, first, 0);
    if (wanted) list[first + __popc(voters & ((1u << lane()) - 1u))] = pixel;
}

// Hands over rays that leave the phase of a level: done, or to the queue of their new level. last: no round comes
// after.
__device__ inline void hand_over(const Rays &rays, bool leaves, const Hit &ray, int pixel, int round, int phase,
                                 bool last) {
    bool done = ray.level <= 0 || (last && ray.level <= phase);
    append(leaves && done && ray.hit, pixel, rays.hits, rays.hit_count);
#pragma unroll
    for (int to = 1; to <= LEVELS; ++to) {
        int then = to > phase ? round : round + 1;
        append(leaves && ray.level == to, pixel, rays.list(then, to), rays.length(then, to));
    }
}
