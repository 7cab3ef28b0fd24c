// queues.cuh: the rays of `fused` that wait to be traced, by the level that they are at.
// A ray that is not done (Hit::level above 0) waits in the queue of its next phase, that of its level where steps are
// plain: this round's where that phase is still to come, else the next round's. There are counters for each round and
// level, so that they are the statistics in the end.
struct Rays {
    Hit *state;                // [pixels]
    Past *past;                // [pixels]
    int *queue[2];             // [LEVELS][pixels] each: pixels, in even and in odd rounds
    int *hits;                 // [pixels] the pixels whose rays are done on the surface
    int *waiting;              // [rounds + 1][LEVELS] lengths of the queues
    int *taken;                // [rounds + 1][LEVELS] how many of these rays teams have taken
    int *hit_count;            // [1] length of hits
    unsigned long long *work;  // [LEVELS] points that each network was evaluated at, then [LEVELS] lanes that did it
    int pixels;

    __device__ int *list(int round, int level) const { return queue[round % 2] + (level - 1) * pixels; }
    __device__ int *length(int round, int level) const { return waiting + round * LEVELS + level - 1; }

    // How many rays wait for a round; and the pixel of one of them, counted level after level, or -1 beyond the last.
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

// Appends the pixels of the lanes that want it to a list. The warp makes one atomicAdd and shares the places by ballot.
__device__ inline void append(bool wanted, int pixel, int *list, int *length) {
    unsigned voters = __ballot_sync(WARP, wanted);
    if (voters == 0) return;
    int first = 0;
    if (lane() == 0) first = atomicAdd(length, __popc(voters));
    first = __shfl_sync(WARP, first, 0);
    if (wanted) list[first + __popc(voters & ((1u << lane()) - 1u))] = pixel;
}

// Hands over rays that leave a phase: to the hits where they are done on the surface, and to the queue of their next
// phase where they are not done. last: whether no round comes after this one.
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
