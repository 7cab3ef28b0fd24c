// cuBLAS on the host, for tests: the three functions that benchmarks/cuda/cublas.cuh looks up. With MPLICITS_HOST_NO_CUBLAS, the
// library is missing.
#pragma once
#include <cstring>

#include "cuda_runtime.h"

#define RTLD_NOW 2

namespace host {
inline int create(void **handle) { return *handle = nullptr, 0; }
inline int destroy(void *) { return 0; }

// c = op(a) b, all column-major.
inline int product(void *, int transposed, int, int m, int n, int k, const void *, const void *a, int kind, int rows,
                   const void *b, int, int b_rows, const void *, void *c, int, int c_rows, int, int) {
    auto entry = [kind](const void *matrix, size_t i) {
        return kind == 2 ? halves()[static_cast<const unsigned short *>(matrix)[i]]
                         : static_cast<const float *>(matrix)[i];
    };
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < m; ++i) {
            float sum = 0.0f;
            for (int l = 0; l < k; ++l) {
                sum +=
                    entry(a, transposed ? size_t(l) + size_t(i) * size_t(rows) : size_t(i) + size_t(l) * size_t(rows)) *
                    entry(b, size_t(l) + size_t(j) * size_t(b_rows));
            }
            static_cast<float *>(c)[size_t(i) + size_t(j) * size_t(c_rows)] = sum;
        }
    }
    return 0;
}
}  // namespace host

inline void *dlopen(const char *, int) { return getenv("MPLICITS_HOST_NO_CUBLAS") ? nullptr : &host::now; }
inline void *dlsym(void *, const char *name) {
    if (strcmp(name, "cublasCreate_v2") == 0) return reinterpret_cast<void *>(host::create);
    if (strcmp(name, "cublasDestroy_v2") == 0) return reinterpret_cast<void *>(host::destroy);
    if (strcmp(name, "cublasGemmEx") == 0) return reinterpret_cast<void *>(host::product);
    return nullptr;
}
