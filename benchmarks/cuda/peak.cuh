// peak.cuh: measures the peak rate of the card's matrix units, in floating-point operations per second.
#include "cublas.cuh"

namespace mplicits {

// Eight independent chains of mma in each warp, with operands in registers.
__global__ void mma_peak(float *sink, int rounds) {
    unsigned a[4] = {threadIdx.x, 1u, 2u, 3u};
    float d[8][4] = {};
    for (int i = 0; i < rounds; ++i) {
#pragma unroll
        for (int chain = 0; chain < 8; ++chain) mma(d[chain], a, threadIdx.x, 7u);
    }
    float sum = 0.0f;
#pragma unroll
    for (int chain = 0; chain < 8; ++chain) sum += d[chain][0] + d[chain][1] + d[chain][2] + d[chain][3];
    if (sum == 1.0f) *sink = sum;
}

template <class Work> double fastest_milliseconds(Work work) {
    Timer timer;
    double least = 1e30;
    for (int i = 0; i < 5; ++i) {
        timer.begin();
        work();
        timer.mark("work");
        timer.finish();
        least = std::fmin(least, timer.total());
    }
    return least;
}

// The fastest of five runs of mma_peak.
inline double measured_mma_peak(int processors, int rounds) {
    Buffer<float> sink(1);
    int blocks = 8 * processors;
    double milliseconds = fastest_milliseconds([&] { launch(mma_peak, blocks, sink.get(), rounds); });
    return 2.0 * 16 * 8 * 16 * 8 * rounds * (THREADS / 32) * blocks / (1e-3 * milliseconds);
}

// The same by cuBLAS, with two n x n matrices of halves; 0 without the library.
inline double measured_cublas_peak(int n) {
    std::unique_ptr<Cublas> cublas = Cublas::open();
    if (!cublas) return 0.0;
    std::vector<unsigned> values(static_cast<size_t>(n) * static_cast<size_t>(n) / 2 + 1);
    unsigned seed = 1;
    for (unsigned &value : values) {
        seed = seed * 1664525u + 1013904223u;
        value = (seed & 0x83ff83ffu) | 0x38003800u;  // halves of either sign from 1/2 to 1
    }
    Buffer<unsigned> a(values), b(values);
    Buffer<float> c(static_cast<size_t>(n) * static_cast<size_t>(n));
    double milliseconds =
        fastest_milliseconds([&] { cublas->product(true, true, n, n, n, a.get(), n, b.get(), c.get()); });
    return 2.0 * n * n * n / (1e-3 * milliseconds);
}

}  // namespace mplicits
