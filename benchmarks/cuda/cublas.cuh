// cublas.cuh: cuBLAS's matrix product. It opens the library, a part of the toolkit, at run time, so that this file
// compiles and links without it.
#pragma once
#include <dlfcn.h>

namespace mplicits {
class Cublas {
public:
    // Opens the library; null where it is not installed.
    static std::unique_ptr<Cublas> open() {
        for (const char *name : {"libcublas.so.13", "libcublas.so.12", "libcublas.so"}) {
            void *library = dlopen(name, RTLD_NOW);
            if (library != nullptr) return std::unique_ptr<Cublas>(new Cublas(library));
        }
        return nullptr;
    }
    ~Cublas() { destroy_(handle_); }
    Cublas(const Cublas &) = delete;
    Cublas &operator=(const Cublas &) = delete;

    // c = op(a) b; op transposes a if `transposed`. c: m x n, float32; a, b: both halves or both float32. All are
    // column-major, and a column of a has `rows` entries.
    void product(bool halves, bool transposed, int m, int n, int k, const void *a, int rows, const void *b,
                 float *c) const {
        const float one = 1.0f, zero = 0.0f;
        const int type = halves ? 2 : 0;  // CUDA_R_16F, CUDA_R_32F
        const int sums = 68, best = -1;   // CUBLAS_COMPUTE_32F, CUBLAS_GEMM_DEFAULT
        int status = product_(handle_, transposed ? 1 : 0, 0, m, n, k, &one, a, type, rows, b, type, k, &zero, c, 0, m,
                              sums, best);
        if (status != 0) refuse("cuBLAS: product of %d x %d and %d x %d failed with status %d", m, k, k, n, status);
    }

private:
    using Create = int (*)(void **);
    using Destroy = int (*)(void *);
    using Product = int (*)(void *, int, int, int, int, int, const void *, const void *, int, int, const void *, int,
                            int, const void *, void *, int, int, int, int);

    explicit Cublas(void *library) {
        auto create = reinterpret_cast<Create>(dlsym(library, "cublasCreate_v2"));
        destroy_ = reinterpret_cast<Destroy>(dlsym(library, "cublasDestroy_v2"));
        product_ = reinterpret_cast<Product>(dlsym(library, "cublasGemmEx"));
        if (create == nullptr || destroy_ == nullptr || product_ == nullptr) refuse("cuBLAS: not the library expected");
        int status = create(&handle_);
        if (status != 0) refuse("cuBLAS: cannot start (status %d); is there memory left on the GPU?", status);
    }

    void *handle_ = nullptr;
    Destroy destroy_;
    Product product_;
};

}  // namespace mplicits
