#include "timer.cuh"
// benchmark.cuh: --benchmark, which prints one JSON object and writes the last frame of each variant and size as PPM.
// useful_tflops counts the products that the march needs, as `fused` counts them: weights without padding, and lanes
// with a ray.

// Floating-point operations that a frame needs.
inline double useful_operations(const Statistics &counted, const Settings &s) {
    double operations = 0.0;
    for (int i = 0; i < LEVELS; ++i) {
        operations +=
            2.0 * static_cast<double>(NETWORKS[i + 1].multiply_adds) * static_cast<double>(counted.evaluated[i]);
        if (shades_hits(s) && i < s.normal_level)
            operations += 4.0 * static_cast<double>(NETWORKS[i + 1].multiply_adds) * counted.hits;
    }
    if (TEXTURED && shades_hits(s)) operations += 2.0 * static_cast<double>(NETWORKS[0].multiply_adds) * counted.hits;
    return operations;
}

// Prints the rays at each level in each round, and the share of lanes with a ray.
inline void print_statistics(const Statistics &counted) {
    printf(", \"hits\": %d, \"rays_per_round\": [", counted.hits);
    for (size_t round = 0; round < counted.waiting.size(); ++round) {
        const std::vector<int> &row = counted.waiting[round];
        printf("%s[", round ? ", " : "");
        for (size_t level = 0; level < LEVELS; ++level) printf("%s%d", level ? ", " : "", row[level]);
        printf("]");
    }
    printf("], \"evaluations\": [");
    for (int i = 0; i < LEVELS; ++i) printf("%s%llu", i ? ", " : "", counted.evaluated[i]);
    printf("], \"lanes_in_use\": [");
    for (int i = 0; i < LEVELS; ++i) {
        double evaluated = static_cast<double>(counted.evaluated[i]), lanes_used = static_cast<double>(counted.lanes_used[i]);
        printf("%s%.4g", i ? ", " : "", lanes_used > 0.0 ? evaluated / lanes_used : 0.0);
    }
    printf("]");
}

// Times one variant at one size. useful: operations of a frame, or 0 where they are unknown.
inline void run_variant(const char *variant, const Arguments &a, const cudaDeviceProp &device, double useful) {
    double before = free_memory();
    Frame frame(variant, a, device);
    double milliseconds = time_frames(variant, frame, a, before - free_memory());
    if (useful > 0.0) printf(", \"useful_tflops\": %.4g", 1e-9 * useful / milliseconds);
    if (std::string(variant) == "fused") print_statistics(frame.statistics());
    printf("}");
    fflush(stdout);
}

// Draws one frame by `fused` to count its operations; 0 where that variant cannot run.
inline double count_useful(const Arguments &a, const cudaDeviceProp &device) {
    if (device.major < 8 || !weights_fit_halves()) return 0.0;
    Frame frame("fused", a, device);
    frame.draw([](const char *) {});
    return useful_operations(frame.statistics(), a.settings);
}

inline void run_benchmark(Arguments a, const cudaDeviceProp &device) {
    int driver = 0, runtime = 0;
    check(cudaDriverGetVersion(&driver), "cudaDriverGetVersion");
    check(cudaRuntimeGetVersion(&runtime), "cudaRuntimeGetVersion");
    bool tensor = device.major >= 8 && weights_fit_halves();
    printf(
        "{\"model\": \"%s\", \"device\": \"%s\", \"compute_capability\": \"%d.%d\", "
        "\"driver_cuda\": %d, \"runtime_cuda\": %d,\n \"sizes\": [\n",
        SHA256, device.name, device.major, device.minor, driver, runtime);
    std::vector<int> sizes = a.sized ? std::vector<int>{0} : std::vector<int>{512, 1024};
    for (size_t i = 0; i < sizes.size(); ++i) {
        if (sizes[i]) a.settings.resolution = vec2(static_cast<float>(sizes[i]));
        printf("  {\"width\": %d, \"height\": %d, \"variants\": [\n", a.settings.width(), a.settings.height());
        double useful = count_useful(a, device);
        if (a.variant != "fused") run_variant("simple", a, device, useful);
        if (a.variant.empty() && tensor) printf(",\n");
        if (a.variant != "simple" && tensor) run_variant("fused", a, device, useful);
        printf("\n  ]}%s\n", i + 1 < sizes.size() ? "," : "");
    }
    printf("]}\n");
}
