#include "packed.cuh"
// tile.cuh: a network at 32 points by one warp, lane = point. Its matrices by the tensor cores, everything else in
// float32. T tiles of 16 points at a time (as registers allow); h: activations as A fragments (mma.cuh); a lane then
// holds points q and q + 8 of each tile, at columns 2 r + {0, 1} of each 8.
template <class Net> struct Tile {
    static constexpr int K = Net::WIDTH / 16;
};

__device__ inline int lane() { return static_cast<int>(threadIdx.x % 32u); }

// The points of T tiles from `base` that this lane works on; p: of this lane.
template <int T> __device__ inline void spread(vec4 p, int base, vec4 (&points)[T][2]) {
    for (int m = 0; m < T; ++m) {
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

// Takes two neighbouring sums of a layer, columns `column` and column + 1 of point (m, r), to what follows them:
// sines into h and, where `slopes` is given, cosines; the last layer's sines into the output rows' sums.
template <class Net, int T, bool LAST> struct Activation {
    unsigned (&h)[T][Tile<Net>::K][4];
    unsigned (*slopes)[Tile<Net>::K][4];
    const float *rows;
    float (&sums)[Net::OUTPUTS][T][2];

    __device__ void operator()(int m, int r, int k, int half, int column, float a0, float a1) {
        float s0 = __sinf(a0), s1 = __sinf(a1);
        if (slopes != nullptr) slopes[m][k][2 * half + r] = pack(__cosf(a0), __cosf(a1));
        if constexpr (LAST) {
#pragma unroll
            for (int c = 0; c < Net::OUTPUTS; ++c) {
                const float *row = rows + c * Net::WIDTH + column;
                sums[c][m][r] += __ldg(row) * s0 + __ldg(row + 1) * s1;
            }
        } else {
            h[m][k][2 * half + r] = pack(s0, s1);
        }
    }
};

template <class Net, int T, bool LAST>
__device__ inline void first_layer(const Packed &net, const vec4 (&points)[T][2], Activation<Net, T, LAST> activation) {
#pragma unroll
    for (int k = 0; k < Tile<Net>::K; ++k) {
#pragma unroll
        for (int half = 0; half < 2; ++half) {
            int column = 16 * k + 8 * half + 2 * (lane() % 4);
            float4 w0 = __ldg(net.first + column), w1 = __ldg(net.first + column + 1);
            float b0 = __ldg(net.bias + column), b1 = __ldg(net.bias + column + 1);
#pragma unroll
            for (int m = 0; m < T; ++m) {
#pragma unroll
                for (int r = 0; r < 2; ++r) {
                    vec4 p = points[m][r];
                    activation(m, r, k, half, column, dot(vec4(w0.x, w0.y, w0.z, w0.w), p) + b0,
                               dot(vec4(w1.x, w1.y, w1.z, w1.w), p) + b1);
                }
            }
        }
    }
}

// d = h times 16 columns of a matrix, from b0 and b1 (each a start value of columns 2 r + {0, 1} of each half).
template <class Net, int T>
__device__ inline void multiply(const uint4 *fragments, const unsigned (&h)[T][Tile<Net>::K][4], float (&d)[T][2][4]) {
#pragma unroll
    for (int k = 0; k < Tile<Net>::K; ++k) {
        uint4 b = __ldg(fragments + 32 * k + lane());
#pragma unroll
        for (int m = 0; m < T; ++m) {
            mma(d[m][0], h[m][k], b.x, b.y);
            mma(d[m][1], h[m][k], b.z, b.w);
        }
    }
}

template <class Net, int T, bool LAST>
__device__ inline void hidden_layer(const Packed &net, int layer, const unsigned (&h)[T][Tile<Net>::K][4],
                                    Activation<Net, T, LAST> activation) {
    constexpr int K = Tile<Net>::K;
#pragma unroll
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
        multiply<Net, T>(net.forward + ((layer - 1) * K + n) * K * 32, h, d);
#pragma unroll
        for (int half = 0; half < 2; ++half) {
            int column = 16 * n + 8 * half + 2 * (lane() % 4);
#pragma unroll
            for (int m = 0; m < T; ++m) {
                activation(m, 0, n, half, column, d[m][half][0], d[m][half][1]);
                activation(m, 1, n, half, column, d[m][half][2], d[m][half][3]);
            }
        }
    }
}

// All layers from J on; h: what layer J - 1 made. slopes: [LAYERS][T][K][4], or null where no gradient is wanted.
template <class Net, int T, int J>
__device__ inline void layers_from(const Packed &net, const vec4 (&points)[T][2], unsigned (&h)[T][Tile<Net>::K][4],
                                   unsigned (*slopes)[T][Tile<Net>::K][4], float (&sums)[Net::OUTPUTS][T][2]) {
    constexpr bool LAST = J == Net::LAYERS - 1;
    unsigned next[T][Tile<Net>::K][4];
    Activation<Net, T, LAST> activation{next, slopes == nullptr ? nullptr : slopes[J], net.rows, sums};
    if constexpr (J == 0) {
        first_layer<Net, T, LAST>(net, points, activation);
    } else {
        hidden_layer<Net, T, LAST>(net, J, h, activation);
    }
    if constexpr (!LAST) layers_from<Net, T, J + 1>(net, points, next, slopes, sums);
}

// Outputs of the network at p, one point per lane.
template <class Net> __device__ inline void evaluate(const Packed &net, vec4 p, float (&outputs)[Net::OUTPUTS]) {
    constexpr int T = Net::WIDTH <= 128 ? 2 : 1;
#pragma unroll
    for (int base = 0; base < 32; base += 16 * T) {
        vec4 points[T][2];
        spread<T>(p, base, points);
        unsigned none[T][Tile<Net>::K][4];
        float sums[Net::OUTPUTS][T][2] = {};
        layers_from<Net, T, 0>(net, points, none, nullptr, sums);
#pragma unroll
        for (int c = 0; c < Net::OUTPUTS; ++c) gather<T>(sums[c], base, outputs[c]);
    }
#pragma unroll
    for (int c = 0; c < Net::OUTPUTS; ++c) outputs[c] = Net::scale(c) * outputs[c] + Net::offset(c);
}
