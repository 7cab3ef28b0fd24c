// mma.cuh: the three instructions of the tensor cores, the layout of their operands in a warp, a block's shared memory,
// copies to it, and a barrier. The tests' host build has its own version. mma.sync.m16n8k16 (PTX ISA, "Matrix Fragments
// for mma.m16n8k16");
// lane = 4 q + r, and a register holds two halves:
//   A, 16 x 16: register 0 rows q, columns 2 r + {0, 1}; 1 rows q + 8; 2 and 3 the same at columns + 8;
//   B, 16 x 8:  register 0 rows 2 r + {0, 1}, column q; register 1 rows + 8;
//   D, 16 x 8:  0 and 1 row q, columns 2 r + {0, 1}; 2 and 3 row q + 8.
// So two neighboring D of one layer are an A of the next, and no activation ever moves to another lane.
constexpr unsigned WARP = 0xffffffffu;

#ifndef MPLICITS_HOST
__device__ inline uint4 *shared_memory() {
    extern __shared__ uint4 words[];
    return words;
}

// d += a b, float16 inputs, float32 sums.
__device__ inline void mma(float (&d)[4], const unsigned (&a)[4], unsigned b0, unsigned b1) {
#if __CUDA_ARCH__ >= 800
    asm volatile("mma.sync.aligned.m16n8k16.row.col.f32.f16.f16.f32 {%0, %1, %2, %3}, {%4, %5, %6, %7}, {%8, %9}, "
                 "{%0, %1, %2, %3};\n"
                 : "+f"(d[0]), "+f"(d[1]), "+f"(d[2]), "+f"(d[3])
                 : "r"(a[0]), "r"(a[1]), "r"(a[2]), "r"(a[3]), "r"(b0), "r"(b1));
#endif
}

// Two floats rounded to halves; the first is in the low bits.
__device__ inline unsigned pack(float low, float high) {
    unsigned both;
    asm("{.reg .f16 a, b;\n cvt.rn.f16.f32 a, %1;\n cvt.rn.f16.f32 b, %2;\n mov.b32 %0, {a, b};}\n"
        : "=r"(both) : "f"(low), "f"(high));
    return both;
}

// Starts the copy of 16 bytes from global to shared memory. Copies since the last end_copies() are a group.
__device__ inline void copy(uint4 *to, const uint4 *from) {
#if __CUDA_ARCH__ >= 800
    unsigned place = static_cast<unsigned>(__cvta_generic_to_shared(to));
    asm volatile("cp.async.cg.shared.global [%0], [%1], 16;\n" ::"r"(place), "l"(from));
#endif
}

__device__ inline void end_copies() {
#if __CUDA_ARCH__ >= 800
    asm volatile("cp.async.commit_group;\n");
#endif
}

// Waits for this thread's copies but those of the last LEFT groups.
template <int LEFT> __device__ inline void wait_for_copies() {
#if __CUDA_ARCH__ >= 800
    asm volatile("cp.async.wait_group %0;\n" ::"n"(LEFT) : "memory");
#endif
}

// Waits for all COUNT threads of the block, whose warps may be at different places of the code, unlike __syncthreads().
template <int COUNT> __device__ inline void wait_anywhere() { asm volatile("bar.sync 1, %0;\n" ::"n"(COUNT) : "memory"); }

__device__ inline void unpack(unsigned both, float &low, float &high) {
    asm("{.reg .f16 a, b;\n mov.b32 {a, b}, %2;\n cvt.f32.f16 %0, a;\n cvt.f32.f16 %1, b;}\n"
        : "=f"(low), "=f"(high) : "r"(both));
}
#endif
