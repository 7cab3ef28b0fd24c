#include "fused.cuh"
// fused_frame.cuh: the host side of `fused`.
// Of trace(): rounds where rays skip cells, and about as many steps where they do not. finish() takes the others.
constexpr int ROUNDS_WITH_CELLS = 1, STEPS_WITHOUT = 40;

// Number of rounds of trace().
inline int rounds_of_trace(const Settings &s) {
    bool relaxed = s.schedule == SCHEDULE_RELAXED;
    if (relaxed && s.level == LEVELS && !MOVING) return std::min(s.rounds, ROUNDS_WITH_CELLS);
    int steps = 0;
    for (int level = relaxed ? s.level : 1; level <= s.level; ++level) steps += ITERATIONS[level - 1];
    return std::min(s.rounds, (STEPS_WITHOUT + steps - 1) / steps);
}

struct Statistics {
    std::vector<std::vector<int>> waiting;  // [round][level] traced rays; the last row is finish()'s
    unsigned long long evaluated[LEVELS] = {}, lanes_used[LEVELS] = {};  // as in Work
    int hits = 0;  // pixels on the surface
};

class Fused {
public:
    Fused(const Settings &s, int processors)
        : processors_(processors), state_(pixels(s)), past_(pixels(s)), even_(pixels(s) * LEVELS), odd_(pixels(s) * LEVELS),
          hits_(pixels(s)), counters_(2 * queues(s) + 1), work_(2 * LEVELS) {
        for (int i = TEXTURED ? 0 : 1; i <= LEVELS; ++i) {
            packings_.emplace_back(NETWORKS[i]);
            networks_.of[i] = packings_.back().upload();
        }
        set_grids(std::integral_constant<int, 1>());
        finish_grid_ = resident<Together>(finish);
        shade_grid_ = resident<Alone>(shade_hits);
    }

    // Draws a frame, and calls mark(name) after each stage.
    template <class Mark> void draw(const Settings &s, vec4 *image, Mark mark) {
        int *hit_count = counters_.get(), *waiting = hit_count + 1, *taken = waiting + queues(s);
        Rays rays = {state_.get(), past_.get(), {even_.get(), odd_.get()}, hits_.get(), waiting, taken,
                     hit_count, work_.get(), s.pixels()};
        counters_.clear();
        work_.clear();
        launch(enter, blocks_for(s.pixels()), s, rays);
        mark("enter");
        int rounds = rounds_of_trace(s);
        for (round_ = 0; round_ < rounds; ++round_) phase(std::integral_constant<int, 1>(), s, rays);
        mark("trace");
        if (round_ < s.rounds) launch(finish, finish_grid_, s, networks_, rays, round_);
        mark("finish");
        launch(paint, blocks_for(s.pixels()), s, static_cast<const Hit *>(state_.get()), image);
        mark("paint");
        if (shades_hits(s)) launch(shade_hits, shade_grid_, s, networks_, rays, image);
        mark("shade");
    }

    Statistics statistics() const {
        Statistics counted;
        std::vector<int> counters = counters_.read();
        for (int round = 0; round <= round_; ++round) {
            auto row = counters.begin() + 1 + round * LEVELS;
            if (std::all_of(row, row + LEVELS, [](int count) { return count == 0; })) break;
            counted.waiting.emplace_back(row, row + LEVELS);
        }
        std::vector<unsigned long long> work = work_.read();
        std::copy(work.begin(), work.begin() + LEVELS, counted.evaluated);
        std::copy(work.begin() + LEVELS, work.end(), counted.lanes_used);
        counted.hits = counters[0];
        return counted;
    }

private:
    static size_t pixels(const Settings &s) { return static_cast<size_t>(s.pixels()); }
    static size_t queues(const Settings &s) { return static_cast<size_t>(s.rounds + 1) * LEVELS; }

    // As many blocks as the device runs at once: the kernels take work until none is left.
    template <class Team, class Kernel> Grid resident(Kernel kernel) const {
        int each = 0;
        check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, Team::SHARED), "shared memory");
        check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&each, kernel, Team::BLOCK, Team::SHARED), "occupancy");
        return Grid(std::max(1, each) * processors_, Team::SHARED, Team::BLOCK);
    }

    template <int PHASE> void set_grids(std::integral_constant<int, PHASE>) {
        trace_grids_.push_back(resident<Alone>(trace<PHASE>));
        if constexpr (PHASE < LEVELS) set_grids(std::integral_constant<int, PHASE + 1>());
    }

    template <int PHASE> void phase(std::integral_constant<int, PHASE>, const Settings &s, const Rays &rays) {
        if (PHASE > s.level) return;
        if (PHASE == s.level || s.schedule == SCHEDULE_PLAIN)
            launch(trace<PHASE>, trace_grids_[PHASE - 1], s, networks_, rays, round_);
        if constexpr (PHASE < LEVELS) phase(std::integral_constant<int, PHASE + 1>(), s, rays);
    }

    int processors_, round_ = 0;
    std::vector<Grid> trace_grids_;  // index: level - 1
    Grid finish_grid_ = 1, shade_grid_ = 1;
    Buffer<Hit> state_;
    Buffer<Past> past_;
    Buffer<int> even_, odd_, hits_, counters_;  // counters: hit_count, waiting, taken of Rays
    Buffer<unsigned long long> work_;
    std::list<Packing> packings_;
    PackedNetworks networks_ = {};
};
