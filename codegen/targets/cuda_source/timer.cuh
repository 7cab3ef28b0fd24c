// timer.cuh: measures the stages of a frame, in milliseconds, by CUDA events.
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
