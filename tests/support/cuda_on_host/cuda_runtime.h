// CUDA on the host, for tests. Every CUDA thread is a fiber. The lanes of a warp run in lockstep between collective
// operations, and two blocks run at once. Random warps pause for up to 255 collectives of the others, so that a missing
// barrier shows. The program aborts where the lanes of a warp do not all reach the same collective. Device memory is
// filled with NaN and ends at a protected page.
// Build: g++ -std=c++17 -DMPLICITS_HOST -I tests/support/cuda_on_host -x c++ model.cu
#pragma once
#include <setjmp.h>
#include <sys/mman.h>
#include <ucontext.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#define __global__
#define __device__
#define __host__
#define __constant__
#define __launch_bounds__(...)

struct dim3 {
    unsigned x, y, z;
    dim3(unsigned x = 1, unsigned y = 1, unsigned z = 1) : x(x), y(y), z(z) {}
};
struct float4 {
    float x, y, z, w;
};
struct uint4 {
    unsigned x, y, z, w;
};

inline dim3 blockDim, gridDim;

namespace host {
constexpr int RESIDENT = 2, MOST_THREADS = 256;
constexpr size_t STACK = 512 * 1024;
enum Operation { SHUFFLE = 1, SHUFFLE_XOR, BALLOT, MMA, BARRIER };

struct Deposit {
    Operation operation;
    unsigned words[6];
};

struct Warp {
    Deposit deposits[2][32];
    bool ended = true;
    int asleep = 0;  // passes of the others that it still skips
};

struct Barrier {
    unsigned arrived = 0, passed = 0, votes = 0, counted = 0;  // votes: of those that have arrived; counted: when all had
};

struct Fiber {
    ucontext_t entry;
    jmp_buf resume;
    bool started = false, ended = true;
    unsigned generation = 0;
    dim3 thread, block;
    Warp *warp = nullptr;
    Barrier *barrier = nullptr;
    std::vector<std::vector<std::pair<uint4 *, const uint4 *>>> copies;  // groups of started copies
    std::unique_ptr<char[]> stack{new char[STACK]};
};

inline Fiber *now;
inline jmp_buf scheduler;
inline const std::function<void()> *body;
inline size_t shared_size;
inline std::vector<uint4> shared_words;

[[noreturn]] inline void fail(const char *what) {
    fprintf(stderr, "host CUDA: %s\n", what);
    abort();
}

// Publishes a lane's words to its warp, and returns the words of all lanes when all have published theirs.
inline const Deposit *meet(Operation operation, std::initializer_list<unsigned> words) {
    Fiber *self = now;
    Deposit *row = self->warp->deposits[self->generation % 2];
    Deposit &mine = row[self->thread.x % 32];
    mine.operation = operation;
    size_t i = 0;
    for (unsigned word : words) mine.words[i++] = word;
    ++self->generation;
    if (_setjmp(self->resume) == 0) _longjmp(scheduler, 1);
    for (int lane = 0; lane < 32; ++lane) {
        if (row[lane].operation != operation) fail("lanes of a warp met at different collectives");
    }
    return row;
}

inline void fiber_main() {
    (*body)();
    now->ended = true;
    _longjmp(scheduler, 1);
}

inline void resume(Fiber &fiber) {
    now = &fiber;
    if (_setjmp(scheduler) != 0) return;
    if (fiber.started) _longjmp(fiber.resume, 1);
    fiber.started = true;
    setcontext(&fiber.entry);
}

__attribute__((noinline)) inline void prepare(Fiber &fiber) {
    getcontext(&fiber.entry);
    fiber.entry.uc_stack.ss_sp = fiber.stack.get();
    fiber.entry.uc_stack.ss_size = STACK;
    fiber.entry.uc_link = nullptr;
    makecontext(&fiber.entry, fiber_main, 0);
}

inline void run_grid(unsigned blocks, unsigned threads, size_t shared, const std::function<void()> &kernel) {
    static std::vector<Fiber> fibers(RESIDENT * MOST_THREADS);
    static std::vector<Warp> warps(RESIDENT * MOST_THREADS / 32);
    static unsigned lot = 1;
    std::vector<Barrier> barriers(RESIDENT);
    shared_size = shared;
    shared_words.assign(RESIDENT * shared / sizeof(uint4), uint4{~0u, ~0u, ~0u, ~0u});
    if (threads % 32 || threads > MOST_THREADS) fail("blocks have up to 256 threads here");
    body = &kernel;
    blockDim = dim3(threads);
    gridDim = dim3(blocks);
    for (unsigned first = 0; first < blocks; first += RESIDENT) {
        size_t count = std::min<size_t>(RESIDENT, blocks - first) * threads;
        for (size_t i = 0; i < count; ++i) {
            Fiber &fiber = fibers[i];
            fiber.thread = dim3(static_cast<unsigned>(i % threads), 0, 0);
            fiber.block = dim3(first + static_cast<unsigned>(i / threads), 0, 0);
            fiber.warp = &warps[i / 32];
            fiber.warp->ended = false;
            fiber.barrier = &barriers[i / threads];
            fiber.started = fiber.ended = false;
            fiber.generation = 0;
            fiber.copies.assign(1, {});
            prepare(fiber);
        }
        for (bool any = true; any;) {
            any = false;
            for (size_t warp = 0; warp < count / 32; ++warp) {
                if (warps[warp].ended) continue;
                any = true;
                if (warps[warp].asleep > 0) {
                    --warps[warp].asleep;
                    continue;
                }
                lot = lot * 1664525u + 1013904223u;
                if (lot >> 27 == 0) warps[warp].asleep = static_cast<int>(lot >> 19);
                int ended = 0;
                for (size_t lane = 0; lane < 32; ++lane) {
                    Fiber &fiber = fibers[32 * warp + lane];
                    if (!fiber.ended) resume(fiber);
                    ended += fiber.ended;
                }
                if (ended != 0 && ended != 32) fail("a lane ended where others of its warp met");
                warps[warp].ended = ended == 32;
            }
        }
    }
}

inline unsigned bits(float value) {
    unsigned word;
    memcpy(&word, &value, sizeof word);
    return word;
}

inline float value(unsigned word) {
    float number;
    memcpy(&number, &word, sizeof number);
    return number;
}

// Conversions between IEEE 754 binary16 and float.
inline float from_half(unsigned half) {
    unsigned exponent = half >> 10 & 31u, mantissa = half & 1023u;
    float size = exponent == 0    ? std::ldexp(static_cast<float>(mantissa), -24)
                 : exponent == 31 ? (mantissa ? NAN : INFINITY)
                                  : std::ldexp(static_cast<float>(1024 + mantissa), static_cast<int>(exponent) - 25);
    return half & 0x8000u ? -size : size;
}

inline unsigned to_half(float number) {
    unsigned sign = std::signbit(number) ? 0x8000u : 0u;
    if (std::isnan(number)) return 0x7fffu;
    float size = std::fabs(number);
    if (size >= 65520.0f) return sign | 0x7c00u;
    int exponent = size < 6.103515625e-5f ? -14 : std::ilogb(size);
    float scaled = std::nearbyint(std::ldexp(size, 10 - exponent));  // 1024 .. 2048, below for subnormals
    return sign | static_cast<unsigned>((exponent + 14) * 1024 + static_cast<int>(scaled));
}

inline const float *halves() {
    static const std::vector<float> table = [] {
        std::vector<float> values(65536);
        for (unsigned i = 0; i < 65536; ++i) values[i] = from_half(i);
        return values;
    }();
    return table.data();
}

// The fragment tables of the PTX ISA ("Matrix Fragments for mma.m16n8k16 with floating point type"), per lane and
// element.
inline int a_row(int group, int i) { return (i < 2 || (i >= 4 && i < 6)) ? group : group + 8; }
inline int a_column(int in_group, int i) { return in_group * 2 + (i & 1) + (i >= 4 ? 8 : 0); }
inline int b_row(int in_group, int i) { return in_group * 2 + (i & 1) + (i >= 2 ? 8 : 0); }
inline int c_row(int group, int i) { return i < 2 ? group : group + 8; }
inline int c_column(int in_group, int i) { return in_group * 2 + (i & 1); }
}  // namespace host

#define threadIdx (host::now->thread)
#define blockIdx (host::now->block)

using std::min;
inline int __popc(unsigned word) { return __builtin_popcount(word); }
inline float __sinf(float a) { return sinf(a); }
inline float __cosf(float a) { return cosf(a); }
template <class T> T __ldg(const T *place) { return *place; }
template <class T> T atomicAdd(T *place, T more) {
    T old = *place;
    *place += more;
    return old;
}
inline unsigned __ballot_sync(unsigned, bool vote) {
    const host::Deposit *all = host::meet(host::BALLOT, {vote});
    unsigned votes = 0;
    for (unsigned lane = 0; lane < 32; ++lane) votes |= all[lane].words[0] << lane;
    return votes;
}
inline bool __any_sync(unsigned mask, bool vote) { return __ballot_sync(mask, vote) != 0; }
template <class T> T __shfl_sync(unsigned, T value, int from) {
    T result;
    unsigned word;
    memcpy(&word, &value, sizeof word);
    word = host::meet(host::SHUFFLE, {word})[from % 32].words[0];
    memcpy(&result, &word, sizeof word);
    return result;
}
inline int __syncthreads_or(bool vote) {
    host::Barrier &barrier = *host::now->barrier;
    unsigned before = barrier.passed;
    barrier.votes += vote;
    if (++barrier.arrived == blockDim.x) {
        barrier.counted = barrier.votes;
        barrier.arrived = barrier.votes = 0;
        ++barrier.passed;
    }
    do host::meet(host::BARRIER, {});
    while (barrier.passed == before);
    return barrier.counted != 0;
}
inline void __syncthreads() { __syncthreads_or(false); }
inline float __shfl_xor_sync(unsigned, float value, int flip) {
    unsigned self = threadIdx.x % 32;
    return host::value(host::meet(host::SHUFFLE_XOR, {host::bits(value)})[self ^ static_cast<unsigned>(flip)].words[0]);
}

namespace mplicits {
inline uint4 *shared_memory() {
    return &host::shared_words[blockIdx.x % host::RESIDENT * (host::shared_size / sizeof(uint4))];
}
template <int COUNT> void wait_anywhere() { __syncthreads(); }
inline void copy(uint4 *to, const uint4 *from) { host::now->copies.back().emplace_back(to, from); }
inline void end_copies() { host::now->copies.emplace_back(); }
// Makes only those copies that it waits for, as late as a GPU may.
template <int LEFT> void wait_for_copies() {
    auto &groups = host::now->copies;
    while (groups.size() > LEFT + 1) {
        for (auto [to, from] : groups.front()) *to = *from;
        groups.erase(groups.begin());
    }
}
inline unsigned pack(float low, float high) { return host::to_half(low) | host::to_half(high) << 16; }
inline void unpack(unsigned both, float &low, float &high) {
    low = host::halves()[both & 0xffffu];
    high = host::halves()[both >> 16];
}

// One lane assembles the 16 x 16 and the 16 x 8 matrix from all lanes; each lane computes its own four sums.
inline void mma(float (&d)[4], const unsigned (&a)[4], unsigned b0, unsigned b1) {
    const host::Deposit *all = host::meet(host::MMA, {a[0], a[1], a[2], a[3], b0, b1});
    static float left[16][16], right[16][8];
    static const host::Deposit *last = nullptr;
    int self = static_cast<int>(threadIdx.x % 32);
    if (self == 0 || all != last) {
        last = all;
        for (int lane = 0; lane < 32; ++lane) {
            const unsigned *words = all[lane].words;
            for (int i = 0; i < 8; ++i) {
                left[host::a_row(lane / 4, i)][host::a_column(lane % 4, i)] =
                    host::halves()[words[i / 2] >> 16 * (i % 2) & 0xffffu];
            }
            for (int i = 0; i < 4; ++i) {
                right[host::b_row(lane % 4, i)][lane / 4] = host::halves()[words[4 + i / 2] >> 16 * (i % 2) & 0xffffu];
            }
        }
    }
    for (int i = 0; i < 4; ++i) {
        int row = host::c_row(self / 4, i), column = host::c_column(self % 4, i);
        for (int k = 0; k < 16; ++k) d[i] += left[row][k] * right[k][column];
    }
}
}  // namespace mplicits

enum cudaError_t {
    cudaSuccess = 0,
    cudaErrorMemoryAllocation = 2,
    cudaErrorInsufficientDriver = 35,
    cudaErrorNoDevice = 100,
    cudaErrorNoKernelImageForDevice = 209,
    cudaErrorUnknown = 999
};
enum cudaMemcpyKind { cudaMemcpyHostToDevice, cudaMemcpyDeviceToHost };
struct cudaLaunchConfig_t {
    dim3 gridDim, blockDim;
    size_t dynamicSmemBytes;
};
struct cudaDeviceProp {
    char name[256];
    int major, minor, multiProcessorCount;
    size_t sharedMemPerBlockOptin;
};
struct cudaFuncAttributes {};
using cudaEvent_t = int *;

// Environment variables that describe the GPU: MPLICITS_HOST_DEVICES, number of devices; MPLICITS_HOST_MAJOR, major
// compute capability; MPLICITS_HOST_MEMORY, bytes of memory.
inline long host_setting(const char *name, long otherwise) {
    const char *text = getenv(name);
    return text == nullptr ? otherwise : atol(text);
}
inline const char *cudaGetErrorString(cudaError_t) { return "host CUDA"; }
inline cudaError_t cudaGetDeviceCount(int *count) {
    *count = static_cast<int>(host_setting("MPLICITS_HOST_DEVICES", 1));
    return *count == 0 ? cudaErrorNoDevice : cudaSuccess;
}
inline cudaError_t cudaGetDeviceProperties(cudaDeviceProp *device, int) {
    *device = {"host", static_cast<int>(host_setting("MPLICITS_HOST_MAJOR", 9)), 0, 2, 232448};
    return cudaSuccess;
}
template <class Kernel> cudaError_t cudaFuncGetAttributes(cudaFuncAttributes *, Kernel) { return cudaSuccess; }
enum { cudaFuncAttributeMaxDynamicSharedMemorySize };
template <class Kernel> cudaError_t cudaFuncSetAttribute(Kernel, int, int) { return cudaSuccess; }
template <class Kernel> cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessor(int *blocks, Kernel, int, size_t) {
    *blocks = 1;
    return cudaSuccess;
}
inline std::map<void *, std::pair<char *, size_t>> host_blocks;
inline size_t host_used = 0;
inline cudaError_t cudaMalloc(void **place, size_t size) {
    const size_t page = 4096, whole = (size + page - 1) / page * page;
    if (host_used + whole > static_cast<size_t>(host_setting("MPLICITS_HOST_MEMORY", 1L << 32)))
        return cudaErrorMemoryAllocation;
    char *start =
        static_cast<char *>(mmap(nullptr, whole + page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    mprotect(start + whole, page, PROT_NONE);
    memset(start, 0xff, whole);
    *place = start + (whole - size) / 16 * 16;
    host_blocks[*place] = {start, whole};
    host_used += whole;
    return cudaSuccess;
}
inline cudaError_t cudaFree(void *place) {
    auto found = host_blocks.find(place);
    if (found == host_blocks.end()) return cudaSuccess;
    munmap(found->second.first, found->second.second + 4096);
    host_used -= found->second.second;
    host_blocks.erase(found);
    return cudaSuccess;
}
inline cudaError_t cudaMemGetInfo(size_t *left, size_t *all) {
    *all = size_t(1) << 32;
    *left = *all - host_used;
    return cudaSuccess;
}
inline cudaError_t cudaMemcpy(void *to, const void *from, size_t size, cudaMemcpyKind) {
    memcpy(to, from, size);
    return cudaSuccess;
}
inline cudaError_t cudaMemsetAsync(void *place, int value, size_t size, int) {
    memset(place, value, size);
    return cudaSuccess;
}
template <class T> cudaError_t cudaMemcpyToSymbol(T &symbol, const void *from, size_t size) {
    if (size > sizeof symbol) return cudaErrorUnknown;
    memcpy(&symbol, from, size);
    return cudaSuccess;
}
template <class... Parameters, class... Arguments>
cudaError_t cudaLaunchKernelEx(const cudaLaunchConfig_t *config, void (*kernel)(Parameters...),
                               Arguments &&...arguments) {
    host::run_grid(config->gridDim.x, config->blockDim.x, config->dynamicSmemBytes, [&] { kernel(arguments...); });
    return cudaSuccess;
}
inline cudaError_t cudaEventCreate(cudaEvent_t *event) { return *event = nullptr, cudaSuccess; }
inline cudaError_t cudaEventDestroy(cudaEvent_t) { return cudaSuccess; }
inline cudaError_t cudaEventRecord(cudaEvent_t, int) { return cudaSuccess; }
inline cudaError_t cudaEventSynchronize(cudaEvent_t) { return cudaSuccess; }
inline cudaError_t cudaEventElapsedTime(float *milliseconds, cudaEvent_t, cudaEvent_t) {
    *milliseconds = 1.0f;
    return cudaSuccess;
}
inline cudaError_t cudaDriverGetVersion(int *version) { return *version = 0, cudaSuccess; }
inline cudaError_t cudaRuntimeGetVersion(int *version) { return *version = 0, cudaSuccess; }
