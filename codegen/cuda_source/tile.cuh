#include "packed.cuh"
// tile.cuh: a network at 32 points by one warp, lane = point. Its matrices by the tensor cores, everything else in
// float32. T tiles of 16 points are worked on at a time; there a lane holds points q and q + 8 of each tile, at columns
// 2 r + {0, 1} of each 8 (mma.cuh). A layer's inputs are in registers; its outputs go to the lane's own words of shared
// memory, so that the loop over them need not be unrolled. No lane reads what another wrote: there are no barriers.
template <class Net> struct Tile {
    static constexpr int K = Net::WIDTH / 16;
    // Level 1, whose error is that of all others, is split where it is narrow: h and W as a sum of two halves each.
    static constexpr bool SPLIT = Net::SPLIT;
    static constexpr int T = (SPLIT ? 2 : 1) * Net::WIDTH <= 256 ? 2 : 1;
    static constexpr int WORDS = (SPLIT ? 2 : 1) * T * K;  // uint4 of a lane
};

template <int LEVEL> constexpr int most_words() {
    int finer = 0;
    if constexpr (LEVEL < LEVELS) finer = most_words<LEVEL + 1>();
    return Tile<NetworkOf<LEVEL>>::WORDS > finer ? Tile<NetworkOf<LEVEL>>::WORDS : finer;
}

constexpr int WORDS = most_words<1 - TEXTURED>();
constexpr int SHARED = WORDS * THREADS * static_cast<int>(sizeof(uint4));  // bytes of a block

__device__ inline int lane() { return static_cast<int>(threadIdx.x % 32u); }

// This lane's words of shared memory: 0, 32, 64, ...
__device__ inline uint4 *scratch() {
    return shared_memory() + threadIdx.x / 32u * static_cast<unsigned>(32 * WORDS) + threadIdx.x % 32u;
}

// The points of T tiles from `base` that this lane works on; p: of this lane.
template <int T> __device__ inline void spread(vec4 p, int base, vec4 (&points)[T][2]) {
#pragma unroll
    for (int m = 0; m < T; ++m) {
#pragma unroll
        for (int r = 0; r < 2; ++r) {
            int from = base + 16 * m + 8 * r + lane() / 4;
            points[m][r] = vec4(__shfl_sync(WARP, p.xyz.x, from), __shfl_sync(WARP, p.xyz.y, from),
                                __shfl_sync(WARP, p.xyz.z, from), __shfl_sync(WARP, p.w, from));
        }
    }
}

// Sums over the lanes of a quad, then brings point base + 16 m + 8 r + q from its quad to its own lane.
template <int T> __device__ inline void gather(float (&sums)[T][2], int base, float &mine) {
#pragma unroll
    for (int m = 0; m < T; ++m) {
#pragma unroll
        for (int r = 0; r < 2; ++r) {
            float sum = sums[m][r];
            sum += __shfl_xor_sync(WARP, sum, 1);
            sum += __shfl_xor_sync(WARP, sum, 2);
            float value = __shfl_sync(WARP, sum, 4 * (lane() % 8));
            if (lane() / 8 == base / 8 + 2 * m + r) mine = value;
        }
    }
}

// 16 columns of a lane's points, D fragments of both halves, as an A fragment.
__device__ inline uint4 as_input(const float (&d)[2][4]) {
    return uint4{pack(d[0][0], d[0][1]), pack(d[0][2], d[0][3]), pack(d[1][0], d[1][1]), pack(d[1][2], d[1][3])};
}

// What as_input() loses.
__device__ inline void subtract_rounded(float (&d)[2][4]) {
#pragma unroll
    for (int i = 0; i < 8; i += 2) {
        float low, high;
        unpack(pack(d[i / 4][i % 4], d[i / 4][i % 4 + 1]), low, high);
        d[i / 4][i % 4] -= low;
        d[i / 4][i % 4 + 1] -= high;
    }
}

template <int T, int K> __device__ inline void load_inputs(int from, unsigned (&h)[T][K][4]) {
#pragma unroll
    for (int m = 0; m < T; ++m) {
#pragma unroll
        for (int k = 0; k < K; ++k) {
            uint4 word = scratch()[32 * (from + m * K + k)];
            h[m][k][0] = word.x;
            h[m][k][1] = word.y;
            h[m][k][2] = word.z;
            h[m][k][3] = word.w;
        }
    }
}

// d += h times 16 columns of a matrix.
template <int T, int K>
__device__ inline void multiply(const uint4 *fragments, const unsigned (&h)[T][K][4], float (&d)[T][2][4]) {
#pragma unroll
    for (int k = 0; k < K; ++k) {
        uint4 b = __ldg(fragments + 32 * k + lane());
#pragma unroll
        for (int m = 0; m < T; ++m) {
            mma(d[m][0], h[m][k], b.x, b.y);
            mma(d[m][1], h[m][k], b.z, b.w);
        }
    }
}

// What follows 16 sums d of a layer, columns from 16 n: sines to scratch and, where a gradient is wanted, cosines to
// slopes [T][K]; the last layer's sines to the output rows' sums.
template <class Net, bool LAST, int T>
__device__ inline void activate(const Packed &net, int n, float (&d)[T][2][4], uint4 *slopes,
                                float (&sums)[Net::OUTPUTS][T][2]) {
    constexpr int K = Tile<Net>::K;
#pragma unroll
    for (int m = 0; m < T; ++m) {
        if (slopes != nullptr) {
            float c[2][4];
#pragma unroll
            for (int i = 0; i < 8; ++i) c[i / 4][i % 4] = __cosf(d[m][i / 4][i % 4]);
            slopes[m * K + n] = as_input(c);
        }
#pragma unroll
        for (int i = 0; i < 8; ++i) d[m][i / 4][i % 4] = __sinf(d[m][i / 4][i % 4]);
        if constexpr (!LAST) {
            scratch()[32 * (m * K + n)] = as_input(d[m]);
            if constexpr (Net::SPLIT) {
                subtract_rounded(d[m]);
                scratch()[32 * ((T + m) * K + n)] = as_input(d[m]);
            }
        }
    }
    if constexpr (LAST) {
#pragma unroll
        for (int half = 0; half < 2; ++half) {
            const float *row = net.rows + 16 * n + 8 * half + 2 * (lane() % 4);
#pragma unroll
            for (int c = 0; c < Net::OUTPUTS; ++c, row += Net::WIDTH) {
                float w0 = __ldg(row), w1 = __ldg(row + 1);
#pragma unroll
                for (int m = 0; m < T; ++m) {
                    sums[c][m][0] += w0 * d[m][half][0] + w1 * d[m][half][1];
                    sums[c][m][1] += w0 * d[m][half][2] + w1 * d[m][half][3];
                }
            }
        }
    }
}

template <class Net, bool LAST, int T>
__device__ inline void first_layer(const Packed &net, const vec4 (&points)[T][2], uint4 *slopes,
                                   float (&sums)[Net::OUTPUTS][T][2]) {
#pragma unroll 1
    for (int n = 0; n < Tile<Net>::K; ++n) {
        float d[T][2][4];
#pragma unroll
        for (int half = 0; half < 2; ++half) {
#pragma unroll
            for (int side = 0; side < 2; ++side) {
                int column = 16 * n + 8 * half + 2 * (lane() % 4) + side;
                vec4 w = as_vec4(__ldg(net.first + column));
                float bias = __ldg(net.bias + column);
#pragma unroll
                for (int m = 0; m < T; ++m) {
                    d[m][half][side] = dot(w, points[m][0]) + bias;
                    d[m][half][2 + side] = dot(w, points[m][1]) + bias;
                }
            }
        }
        activate<Net, LAST>(net, n, d, slopes, sums);
    }
}

template <class Net, bool LAST, int T>
__device__ inline void hidden_layer(const Packed &net, int layer, uint4 *slopes, float (&sums)[Net::OUTPUTS][T][2]) {
    constexpr int K = Tile<Net>::K;
    unsigned h[T][K][4], rest[Net::SPLIT ? T : 1][Net::SPLIT ? K : 1][4];
    load_inputs(0, h);
    if constexpr (Net::SPLIT) load_inputs(T * K, rest);
#pragma unroll 1
    for (int n = 0; n < K; ++n) {
        float d[T][2][4];
#pragma unroll
        for (int half = 0; half < 2; ++half) {
            const float *bias = net.bias + layer * Net::WIDTH + 16 * n + 8 * half + 2 * (lane() % 4);
            float b0 = __ldg(bias), b1 = __ldg(bias + 1);
#pragma unroll
            for (int m = 0; m < T; ++m) {
                d[m][half][0] = d[m][half][2] = b0;
                d[m][half][1] = d[m][half][3] = b1;
            }
        }
        int place = ((layer - 1) * K + n) * K * 32;
        multiply(net.forward + place, h, d);
        if constexpr (Net::SPLIT) {
            multiply(net.forward + place, rest, d);
            multiply(net.forward_rest + place, h, d);
        }
        activate<Net, LAST>(net, n, d, slopes, sums);
    }
}

// The network at T tiles: sums of its output rows; slopes [LAYERS][T][K], or null where no gradient is wanted.
template <class Net, int T>
__device__ inline void forward(const Packed &net, const vec4 (&points)[T][2], uint4 *slopes,
                               float (&sums)[Net::OUTPUTS][T][2]) {
    auto of_layer = [=](int layer) { return slopes == nullptr ? nullptr : slopes + layer * T * Tile<Net>::K; };
    first_layer<Net, Net::LAYERS == 1>(net, points, of_layer(0), sums);
#pragma unroll 1
    for (int layer = 1; layer < Net::LAYERS - 1; ++layer) hidden_layer<Net, false>(net, layer, of_layer(layer), sums);
    if constexpr (Net::LAYERS > 1) hidden_layer<Net, true>(net, Net::LAYERS - 1, of_layer(Net::LAYERS - 1), sums);
}

// Outputs of the network at p, one point per lane.
template <class Net> __device__ inline void evaluate(const Packed &net, vec4 p, float (&outputs)[Net::OUTPUTS]) {
    constexpr int T = Tile<Net>::T;
#pragma unroll
    for (int c = 0; c < Net::OUTPUTS; ++c) outputs[c] = 0.0f;
#pragma unroll 1
    for (int base = 0; base < 32; base += 16 * T) {
        vec4 points[T][2];
        spread(p, base, points);
        float sums[Net::OUTPUTS][T][2] = {};
        forward<Net>(net, points, nullptr, sums);
#pragma unroll
        for (int c = 0; c < Net::OUTPUTS; ++c) gather(sums[c], base, outputs[c]);
    }
#pragma unroll
    for (int c = 0; c < Net::OUTPUTS; ++c) outputs[c] = Net::scale(c) * outputs[c] + Net::offset(c);
}
