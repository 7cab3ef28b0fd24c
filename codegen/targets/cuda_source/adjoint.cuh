#include "tile.cuh"
// adjoint.cuh: a network's gradient at 32 points by each warp of a block: g = (g * cos a_j) W_j, from the output row back to the
// first layer. g is in halves, multiplied by Packed::lift; the first layer is in float32.

// Multiplies the sums d of g, at columns 16 n .. 16 n + 15, by the layer's cosines. The products go to scratch or, from
// the first layer, times its rows, to the gradient's sums.
template <class Net, bool FIRST, int T>
__device__ inline void descend(const Packed &net, int n, float (&d)[T][2][4], const uint4 *slopes,
                               float (&sums)[3][T][2]) {
    constexpr int K = Tile<Net>::K;
#pragma unroll
    for (int m = 0; m < T; ++m) {
        uint4 cosines = slopes[m * K + n];
        const unsigned parts[4] = {cosines.x, cosines.y, cosines.z, cosines.w};
#pragma unroll
        for (int part = 0; part < 4; ++part) {
            float c0, c1;
            unpack(parts[part], c0, c1);
            d[m][part / 2][part % 2 * 2] *= c0;
            d[m][part / 2][part % 2 * 2 + 1] *= c1;
        }
        if constexpr (!FIRST) Alone::scratch()[32 * (m * K + n)] = as_input(d[m]);
    }
    if constexpr (FIRST) {
#pragma unroll
        for (int i = 0; i < 4; ++i) {
            float4 w = __ldg(net.first + 16 * n + i / 2 * 8 + 2 * (lane() % 4) + i % 2);
#pragma unroll
            for (int m = 0; m < T; ++m) {
#pragma unroll
                for (int r = 0; r < 2; ++r) {
                    float g = d[m][i / 2][2 * r + i % 2];
                    sums[0][m][r] += g * w.x;
                    sums[1][m][r] += g * w.y;
                    sums[2][m][r] += g * w.z;
                }
            }
        }
    }
}

// Starts with g at the last layer's sines: the output row.
template <class Net, int T>
__device__ inline void output_row(const Packed &net, const uint4 *slopes, float (&sums)[3][T][2]) {
#pragma unroll 1
    for (int n = 0; n < Tile<Net>::K; ++n) {
        float d[T][2][4];
#pragma unroll
        for (int i = 0; i < 4; ++i) {
            float entry = net.lift * __ldg(net.rows + 16 * n + i / 2 * 8 + 2 * (lane() % 4) + i % 2);
#pragma unroll
            for (int m = 0; m < T; ++m) d[m][i / 2][i % 2] = d[m][i / 2][2 + i % 2] = entry;
        }
        descend<Net, Net::LAYERS == 1>(net, n, d, slopes, sums);
    }
}

// Computes g at the previous layer, to which slopes belong, from g at layer `layer`.
template <class Net, bool FIRST, int T>
__device__ inline void layer_back(const Packed &net, int layer, const uint4 *slopes, float (&sums)[3][T][2]) {
    constexpr int K = Tile<Net>::K;
    Operands<K, Alone, 1> weights(net.backward + (layer - 1) * K * K * 32, nullptr);
    unsigned g[T][K][4];
    load_inputs<Alone>(0, g);
#pragma unroll 1
    for (int n = 0; n < K; ++n) {
        weights.await(n);
        float d[T][2][4] = {};
#pragma unroll
        for (int k = 0; k < K; ++k) multiply(weights.get(0, n, k), g, k, d);
        descend<Net, FIRST>(net, n, d, slopes, sums);
    }
}

// Gradient of the network's only output at p, this lane's point.
template <class Net> __device__ inline vec3 evaluate_gradient(const Packed &net, vec4 p) {
    constexpr int T = Tile<Net>::T, SIZE = T * Tile<Net>::K, LAST = Net::LAYERS - 1;
    vec3 gradient(0.0f);
#pragma unroll 1
    for (int base = 0; base < 32; base += 16 * T) {
        vec4 points[T][2];
        spread(p, base, points);
        uint4 slopes[Net::LAYERS * SIZE];
        float value[Net::OUTPUTS][T][2] = {}, sums[3][T][2] = {};
        forward<Net, Alone>(net, points, true, slopes, value);
        output_row<Net>(net, slopes + LAST * SIZE, sums);
#pragma unroll 1
        for (int layer = LAST; layer > 1; --layer)
            layer_back<Net, false>(net, layer, slopes + (layer - 1) * SIZE, sums);
        if constexpr (LAST > 0) layer_back<Net, true>(net, 1, slopes, sums);
        gather(sums[0], base, gradient.x);
        gather(sums[1], base, gradient.y);
        gather(sums[2], base, gradient.z);
    }
    return Net::scale(0) / net.lift * gradient;
}
