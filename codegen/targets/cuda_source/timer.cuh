#include "arguments.cuh"
#include "picture.cuh"
// timer.cuh: measures frames and their stages, in milliseconds, by CUDA events.
class Timer {
public:
    Timer() { check(cudaEventCreate(&start_), "cudaEventCreate"); }
    Timer(const Timer &) = delete;
    Timer &operator=(const Timer &) = delete;
    ~Timer() {
        cudaEventDestroy(start_);
        for (cudaEvent_t event : events_) cudaEventDestroy(event);
    }
    void begin() {
        names_.clear();
        check(cudaEventRecord(start_, 0), "cudaEventRecord");
    }
    void mark(const char *name) {
        if (events_.size() == names_.size()) {
            events_.emplace_back();
            check(cudaEventCreate(&events_.back()), "cudaEventCreate");
        }
        check(cudaEventRecord(events_[names_.size()], 0), "cudaEventRecord");
        names_.push_back(name);
    }
    void finish() { check(cudaEventSynchronize(events_[names_.size() - 1]), "a frame"); }
    const std::vector<std::string> &names() const { return names_; }
    double stage(size_t i) const { return between(i == 0 ? start_ : events_[i - 1], events_[i]); }
    double total() const { return between(start_, events_[names_.size() - 1]); }

private:
    static double between(cudaEvent_t from, cudaEvent_t to) {
        float milliseconds = 0.0f;
        check(cudaEventElapsedTime(&milliseconds, from, to), "cudaEventElapsedTime");
        return milliseconds;
    }
    cudaEvent_t start_ = nullptr;
    std::vector<cudaEvent_t> events_;
    std::vector<std::string> names_;
};

inline double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    size_t middle = values.size() / 2;
    return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

// Free memory of the device, MiB.
inline double free_memory() {
    size_t left = 0, all = 0;
    check(cudaMemGetInfo(&left, &all), "cudaMemGetInfo");
    return static_cast<double>(left) / 1048576.0;
}

// Times the frames of a variant, prints its row of the JSON without the closing brace, and writes the last frame as
// PPM. label: in the row and in the file's name; memory: of the variant, MiB. Returns a frame's milliseconds.
template <class Drawn> double time_frames(const char *label, Drawn &frame, const Arguments &a, double memory) {
    Timer timer;
    std::vector<double> totals;
    std::vector<std::vector<double>> stages;
    int warm_up = std::max(1, a.frames / 10);
    for (int i = 0; i < warm_up + a.frames; ++i) {
        timer.begin();
        frame.draw([&](const char *name) { timer.mark(name); });
        timer.finish();
        if (i < warm_up) continue;
        totals.push_back(timer.total());
        stages.resize(timer.names().size());
        for (size_t k = 0; k < stages.size(); ++k) stages[k].push_back(timer.stage(k));
    }
    double milliseconds = median(totals);
    printf(
        "      {\"variant\": \"%s\", \"rounds\": %d, \"fps\": %.6g, \"milliseconds\": %.6g, \"frames\": %d, "
        "\"memory_mib\": %.1f, \"stages\": {",
        label, a.settings.rounds, 1e3 / milliseconds, milliseconds, a.frames, memory);
    for (size_t k = 0; k < stages.size(); ++k)
        printf("%s\"%s\": %.6g", k ? ", " : "", timer.names()[k].c_str(), median(stages[k]));
    printf("}");
    std::string base = a.output.size() > 4 && a.output.substr(a.output.size() - 4) == ".ppm"
                           ? a.output.substr(0, a.output.size() - 4)
                           : a.output;
    std::string name = base + "-" + label + "-" + std::to_string(a.settings.width()) + ".ppm";
    write_ppm(name, frame.image(), a.settings.width(), a.settings.height());
    return milliseconds;
}
