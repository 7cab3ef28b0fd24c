// A model's CUDA program with two more commands, for measurements. model.cu is what `mplicits bake` writes:
//     nvcc -O3 -arch=native -I FOLDER_OF_MODEL_CU comparison.cu -o comparison
//     comparison layered [OPTION ...]   draws as the paper's renderer does; the program's options without --variant
//     comparison peaks ROUNDS SIZE      JSON: rates of the matrix units: of mma, ROUNDS times a warp, and of a product
//                                       by cuBLAS of two SIZE x SIZE matrices
//     comparison [OPTION ...]           the program
#define main model_main
#include "model.cu"
#undef main

#include "layered_frame.cuh"
#include "peak.cuh"

namespace mplicits {

inline int layered(int count, char **values) {
    Arguments a = read_arguments(count, values);
    if (!a.variant.empty()) refuse("layered: leave --variant out");
    a.variant = "layered";
    cudaDeviceProp device = the_device();
    if (device.major < 8 || !weights_fit_halves())
        refuse("layered needs compute capability 8.0, and weights in float16's range");
    std::unique_ptr<Cublas> cublas = Cublas::open();
    if (!cublas) refuse("layered: libcublas.so is not found; it comes with the CUDA toolkit");
    set_constants(a, nullptr, 0);
    if (!a.benchmark) {
        Layered frame(a, *cublas);
        frame.draw([](const char *) {});
        return deliver(a, frame.image());
    }
    printf("{\"sizes\": [{\"variants\": [\n");
    for (const char *label : {"layered", "layered-one-round"}) {
        if (label != a.variant) {
            a.settings.rounds = 1;
            printf(",\n");
        }
        double before = free_memory();
        Layered frame(a, *cublas);
        double milliseconds = time_frames(label, frame, a, before - free_memory());
        printf(", \"executed_tflops\": %.4g}", 1e-9 * frame.executed() / milliseconds);  // of all products
    }
    printf("]}]}\n");
    return 0;
}

inline int peaks(int rounds, int size) {
    cudaDeviceProp device = the_device();
    double of_mma = device.major < 8 ? 0.0 : measured_mma_peak(device.multiProcessorCount, rounds);
    printf("{\"peak_mma_tflops\": %.4g, \"peak_cublas_tflops\": %.4g}\n", 1e-12 * of_mma,
           1e-12 * measured_cublas_peak(size));
    return 0;
}

inline int compare(int count, char **values) {
    std::string command = count > 1 ? values[1] : "";
    if (command == "layered") return layered(count - 1, values + 1);
    if (command == "peaks" && count == 4)
        return peaks(whole("ROUNDS", values[2], 1, 1 << 20), whole("SIZE", values[3], 2, 1 << 15));
    return run(count, values);
}

}  // namespace mplicits

int main(int count, char **values) { return mplicits::compare(count, values); }
