#include "tile.cuh"
// adjoint.cuh: a network's gradient at 32 points by one warp: g = (g * cos a_j) W_j, from the output row back.
// g is kept in halves times Packed::lift; the first layer's share is in float32.
template <class Net, int T>
__device__ inline void into_gradient(const Packed &net, int m, int r, int column, float g0, float g1,
                                     float (&sums)[3][T][2]) {
    float4 w0 = __ldg(net.first + column), w1 = __ldg(net.first + column + 1);
    sums[0][m][r] += g0 * w0.x + g1 * w1.x;
    sums[1][m][r] += g0 * w0.y + g1 * w1.y;
    sums[2][m][r] += g0 * w0.z + g1 * w1.z;
}

// From g at layer J's sines to the gradient.
template <class Net, int T, int J>
__device__ inline void layers_back(const Packed &net, const unsigned (&g)[T][Tile<Net>::K][4],
                                   const unsigned (*slopes)[T][Tile<Net>::K][4], float (&sums)[3][T][2]) {
    if constexpr (J > 0) {
        constexpr int K = Tile<Net>::K;
        unsigned next[T][K][4];
#pragma unroll
        for (int n = 0; n < K; ++n) {
            float d[T][2][4] = {};
            multiply<Net, T>(net.backward + ((J - 1) * K + n) * K * 32, g, d);
#pragma unroll
            for (int m = 0; m < T; ++m) {
#pragma unroll
                for (int part = 0; part < 4; ++part) {
                    int half = part / 2, r = part % 2;
                    float c0, c1;
                    unpack(slopes[J - 1][m][n][part], c0, c1);
                    float g0 = d[m][half][2 * r] * c0, g1 = d[m][half][2 * r + 1] * c1;
                    if constexpr (J == 1) {
                        into_gradient<Net, T>(net, m, r, 16 * n + 8 * half + 2 * (lane() % 4), g0, g1, sums);
                    } else {
                        next[m][n][part] = pack(g0, g1);
                    }
                }
            }
        }
        if constexpr (J > 1) layers_back<Net, T, J - 1>(net, next, slopes, sums);
    }
}

// Gradient of the network's one output at p, one point per lane.
template <class Net> __device__ inline vec3 evaluate_gradient(const Packed &net, vec4 p) {
    constexpr int T = Net::WIDTH <= 64 ? 2 : 1, K = Tile<Net>::K, LAST = Net::LAYERS - 1;
    vec3 gradient(0.0f);
#pragma unroll 1
    for (int base = 0; base < 32; base += 16 * T) {
        vec4 points[T][2];
        spread<T>(p, base, points);
        unsigned none[T][K][4], slopes[Net::LAYERS][T][K][4], g[T][K][4];
        float value[1][T][2] = {}, sums[3][T][2] = {};
        layers_from<Net, T, 0>(net, points, none, slopes, value);
#pragma unroll
        for (int k = 0; k < K; ++k) {
#pragma unroll
            for (int m = 0; m < T; ++m) {
#pragma unroll
                for (int part = 0; part < 4; ++part) {
                    int column = 16 * k + 8 * (part / 2) + 2 * (lane() % 4);
                    float c0, c1;
                    unpack(slopes[LAST][m][k][part], c0, c1);
                    float g0 = net.lift * __ldg(net.rows + column) * c0;
                    float g1 = net.lift * __ldg(net.rows + column + 1) * c1;
                    if constexpr (LAST == 0) {
                        into_gradient<Net, T>(net, m, part % 2, column, g0, g1, sums);
                    } else {
                        g[m][k][part] = pack(g0, g1);
                    }
                }
            }
        }
        layers_back<Net, T, LAST>(net, g, slopes, sums);
        gather<T>(sums[0], base, gradient.x);
        gather<T>(sums[1], base, gradient.y);
        gather<T>(sums[2], base, gradient.z);
    }
    return Net::scale(0) / net.lift * gradient;
}
