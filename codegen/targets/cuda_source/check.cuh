// check.cuh: errors (one line, exit code 2), device memory, and launches of kernels.
[[noreturn]] __attribute__((format(printf, 1, 2))) inline void refuse(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    fflush(stdout);
    fputs("error: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    exit(2);
}

inline void check(cudaError_t error, const char *what) {
    switch (error) {
        case cudaSuccess: return;
        case cudaErrorNoDevice: refuse("no CUDA device; run this on a machine with an NVIDIA GPU");
        case cudaErrorInsufficientDriver: refuse("no NVIDIA driver, or one older than this CUDA toolkit; update it");
        case cudaErrorMemoryAllocation: refuse("out of memory on the GPU (%s); choose a smaller --size", what);
        case cudaErrorNoKernelImageForDevice: refuse("compiled for another GPU; compile again with nvcc -arch=native");
        default: refuse("%s: %s", what, cudaGetErrorString(error));
    }
}

// An array on the device; its destructor frees it.
template <class T> class Buffer {
public:
    explicit Buffer(size_t count) : count_(count) {
        check(cudaMalloc(reinterpret_cast<void **>(&data_), count * sizeof(T)), "cudaMalloc");
    }
    explicit Buffer(const std::vector<T> &values) : Buffer(values.size()) {
        check(cudaMemcpy(data_, values.data(), values.size() * sizeof(T), cudaMemcpyHostToDevice), "cudaMemcpy");
    }
    Buffer(const Buffer &) = delete;
    Buffer &operator=(const Buffer &) = delete;
    ~Buffer() { cudaFree(data_); }
    T *get() const { return data_; }
    void clear() const { check(cudaMemsetAsync(data_, 0, count_ * sizeof(T), 0), "cudaMemset"); }
    std::vector<T> read() const {
        std::vector<T> values(count_);
        check(cudaMemcpy(values.data(), data_, count_ * sizeof(T), cudaMemcpyDeviceToHost), "a kernel");
        return values;
    }

private:
    T *data_ = nullptr;
    size_t count_;
};

constexpr int THREADS = 128;

struct Grid {
    int blocks, shared, threads;  // number of blocks; bytes of shared memory and threads of a block
    Grid(int blocks, int shared = 0, int threads = THREADS) : blocks(blocks), shared(shared), threads(threads) {}
};

// Launches kernel(values...) in stream 0.
template <class... Parameters, class... Values>
void launch(void (*kernel)(Parameters...), Grid grid, Values &&...values) {
    cudaLaunchConfig_t config = {};
    config.gridDim = dim3(static_cast<unsigned>(grid.blocks));
    config.blockDim = dim3(static_cast<unsigned>(grid.threads));
    config.dynamicSmemBytes = static_cast<size_t>(grid.shared);
    check(cudaLaunchKernelEx(&config, kernel, std::forward<Values>(values)...), "kernel launch");
}

inline int blocks_for(long long threads) { return static_cast<int>((threads + THREADS - 1) / THREADS); }
