#include "fused.cuh"
// fused_frame.cuh: the host side of `fused`.
constexpr int ROUNDS_RELAXED = 1, ROUNDS_PLAIN = 3;  // by trace(); finish() does the others
constexpr int ROUNDS_FINISHED = 3;  // after which the rays that finish() has left are gathered

struct Statistics {
    std::vector<std::vector<int>> waiting;  // [round][level] rays that waited when a kernel began; else 0
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
        int *waiting = counters_.get(), *taken = waiting + queues(s);
        Rays rays = {state_.get(), past_.get(), {even_.get(), odd_.get()}, hits_.get(), waiting, taken,
                     taken + queues(s), work_.get(), s.pixels()};
        counters_.clear();
        work_.clear();
        launch(enter, blocks_for(s.pixels()), s, rays);
        mark("enter");
        int rounds = std::min(s.rounds, s.schedule == SCHEDULE_RELAXED ? ROUNDS_RELAXED : ROUNDS_PLAIN);
        for (round_ = 0; round_ < rounds; ++round_) phase(std::integral_constant<int, 1>(), s, rays);
        mark("trace");
        for (int end = rounds + ROUNDS_FINISHED; round_ < s.rounds; end = s.rounds) {
            end = std::min(end, s.rounds);
            launch(finish, finish_grid_, s, networks_, rays, round_, end);
            round_ = end;
        }
        mark("finish");
        launch(paint, blocks_for(s.pixels()), s, static_cast<const Hit *>(state_.get()), image);
        mark("paint");
        if (shades_hits(s)) launch(shade_hits, shade_grid_, s, networks_, rays, image);
        mark("shade");
    }

    Statistics statistics() const {
        Statistics counted;
        std::vector<int> waiting = counters_.read();
        for (int round = 0; round <= round_; ++round) {
            auto row = waiting.begin() + round * LEVELS;
            counted.waiting.emplace_back(row, row + LEVELS);
        }
        while (!counted.waiting.empty() && counted.waiting.back() == std::vector<int>(LEVELS)) counted.waiting.pop_back();
        std::vector<unsigned long long> work = work_.read();
        std::copy(work.begin(), work.begin() + LEVELS, counted.evaluated);
        std::copy(work.begin() + LEVELS, work.end(), counted.lanes_used);
        counted.hits = waiting.back();
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
    Buffer<int> even_, odd_, hits_, counters_;  // counters: waiting, taken, hit_count of Rays
    Buffer<unsigned long long> work_;
    std::list<Packing> packings_;
    PackedNetworks networks_ = {};
};
