// queues.cuh: the waiting rays of `fused`, by level. An unfinished ray (Hit::level above 0) waits in the queue of its
// next phase, which in the plain schedule is its level's: this round's queue where that phase is still to come, else
// the next round's. Each round and level has counters, which become the statistics.
struct Rays {
    Hit *state;                // [pixels]
    Past *past;                // [pixels]
    int *queue[2];             // [LEVELS][pixels] each: pixels, in even and in odd rounds
    int *hits;                 // [pixels] pixels whose rays ended on the surface
    int *waiting;              // [rounds + 1][LEVELS] lengths of the queues
    int *taken;                // [rounds + 1][LEVELS] rays that teams have taken
    int *hit_count;            // [1] length of hits
    unsigned long long *work;  // [LEVELS] evaluations of each network, then [LEVELS] lanes that took part
    int pixels;

    __device__ int *list(int round, int level) const { return queue[round % 2] + (level - 1) * pixels; }
    __device__ int *length(int round, int level) const { return waiting + round * LEVELS + level - 1; }

    // Number of rays that wait for a round; and the pixel of one of them, counted level by level, or -1 beyond the
    // last.
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

// Appends the pixels of the wanted lanes to a list. The warp makes one atomicAdd and shares the places by ballot.
__device__ inline void append(bool wanted, int pixel, int *list, int *length) {
    unsigned voters = __ballot_sync(WARP, wanted);
    if (voters == 0) return;
    int first = 0;
    if (lane() == 0) first = atomicAdd(length, __popc(voters));
    first = __shfl_sync(WARP, first, 0);
    if (wanted) list[first + __popc(voters & ((1u << lane()) - 1u))] = pixel;
}

// Moves rays that leave a phase: to the hits if they end on the surface, to the queue of their next phase if
// unfinished. last: whether this is the last round.
__device__ inline void hand_over(const Rays &rays, bool leaves, const Hit &ray, int next, int pixel, int round,
                                 int phase, bool last) {
    bool done = next <= 0 || (last && next <= phase);
    append(leaves && done && ray.hit, pixel, rays.hits, rays.hit_count);
#pragma unroll
    for (int to = 1; to <= LEVELS; ++to) {
        int then = to > phase ? round : round + 1;
        append(leaves && next == to, pixel, rays.list(then, to), rays.length(then, to));
    }
}
