#include "arguments.cuh"
#include "frames.cuh"
#include "picture.cuh"
#include "unpack.cuh"
#include "benchmark.cuh"
// main.cuh: the program.

// The first GPU, after a check that this file was compiled for it.
inline cudaDeviceProp the_device() {
    int count = 0;
    check(cudaGetDeviceCount(&count), "cudaGetDeviceCount");
    if (count == 0) check(cudaErrorNoDevice, "cudaGetDeviceCount");
    cudaDeviceProp device;
    check(cudaGetDeviceProperties(&device, 0), "cudaGetDeviceProperties");
    cudaFuncAttributes attributes;
    check(cudaFuncGetAttributes(&attributes, render_simple), "cudaFuncGetAttributes");
    return device;
}

// grid: on the device, or without cells.
inline void set_constants(const Arguments &a, const unsigned char *grid, int count) {
    check(cudaMemcpyToSymbol(weights, WEIGHTS, sizeof WEIGHTS), "cudaMemcpyToSymbol");
    check(cudaMemcpyToSymbol(iterations, a.steps.data(), LEVELS * sizeof(int)), "cudaMemcpyToSymbol");
    check(cudaMemcpyToSymbol(delta, a.deltas.data(), LEVELS * sizeof(float)), "cudaMemcpyToSymbol");
    check(cudaMemcpyToSymbol(step_bound, STEP_BOUNDS, LEVELS * sizeof(float)), "cudaMemcpyToSymbol");
    check(cudaMemcpyToSymbol(band_step_bound, BAND_STEP_BOUNDS, LEVELS * sizeof(float)), "cudaMemcpyToSymbol");
    check(cudaMemcpyToSymbol(time, &a.time, sizeof(float)), "cudaMemcpyToSymbol");
    check(cudaMemcpyToSymbol(cells, &grid, sizeof grid), "cudaMemcpyToSymbol");
    check(cudaMemcpyToSymbol(cell_count, &count, sizeof count), "cudaMemcpyToSymbol");
    check(cudaMemcpyToSymbol(cells_half, &CELLS_HALF, sizeof(float)), "cudaMemcpyToSymbol");
}

// Writes the picture, unless it is only compared, and compares it with the reference. Returns the exit code.
inline int deliver(const Arguments &a, const std::vector<vec4> &image) {
    int width = a.settings.width(), height = a.settings.height();
    if (a.reference.empty() || a.named) {
        if (a.settings.shading == SHADE_DATA) {
            write_data(a.output, image, width, height);
        } else {
            write_ppm(a.output, image, width, height);
        }
    }
    if (a.reference.empty()) return 0;
    double agreement = psnr(to_bytes(image, width, height), read_ppm(a.reference, width, height));
    bool good = agreement >= a.least_psnr;
    printf("%s: %s, PSNR %.2f dB, at least %.2f wanted\n", good ? "agrees" : "DISAGREES", a.variant.c_str(), agreement,
           a.least_psnr);
    return good ? 0 : 1;
}

inline int run(int count, char **values) {
    Arguments a = read_arguments(count, values);
    cudaDeviceProp device = the_device();
    std::vector<unsigned char> grid = cells_for(a);
    Buffer<unsigned char> on_device(grid);
    set_constants(a, on_device.get(), grid.empty() ? 0 : CELL_COUNT);
    if (a.benchmark) {
        run_benchmark(a, device);
        return 0;
    }
    if (a.variant.empty()) a.variant = device.major >= 8 && weights_fit_halves() ? "fused" : "simple";
    Frame frame(a.variant, a, device);
    frame.draw([](const char *) {});
    return deliver(a, frame.image());
}
