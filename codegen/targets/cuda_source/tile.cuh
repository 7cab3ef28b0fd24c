#include "team.cuh"
// tile.cuh: one team evaluates a network at its points, one per lane: products on the tensor cores, everything else in
// float32. It works on T tiles of 16 points at a time. A lane holds points q and q + 8 of each tile, in two columns of
// each 8: 2 r and 2 r + 1 (mma.cuh). A layer's inputs are in registers. Its outputs go to the lane's own words of
// shared memory, so that the loop over them need not be unrolled. A lane reads only its own words, so that a single
// warp needs no barrier.

// A network without the split into halves, for points where the rounding error is far below the band half-width.
template <class Net> struct Rough : Net {
    static constexpr bool SPLIT = false;
};

// The points of T tiles, from lane `base` on, for this lane. p: this lane's own point.
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

// Adds the sums of the four lanes that work on a point, and moves those of point base + 16 m + 8 r + q to that point's
// lane, as `mine`.
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

// Rounds 16 columns of a lane's points (the D fragments of two mma) to halves: an A fragment.
__device__ inline uint4 as_input(const float (&d)[2][4]) {
    return uint4{pack(d[0][0], d[0][1]), pack(d[0][2], d[0][3]), pack(d[1][0], d[1][1]), pack(d[1][2], d[1][3])};
}

// Leaves the rounding error of as_input() in d.
__device__ inline void subtract_rounded(float (&d)[2][4]) {
#pragma unroll
    for (int i = 0; i < 8; i += 2) {
        float low, high;
        unpack(pack(d[i / 4][i % 4], d[i / 4][i % 4 + 1]), low, high);
        d[i / 4][i % 4] -= low;
        d[i / 4][i % 4 + 1] -= high;
    }
}

template <class Team, int T, int K> __device__ inline void load_inputs(int from, unsigned (&h)[T][K][4]) {
#pragma unroll
    for (int m = 0; m < T; ++m) {
#pragma unroll
        for (int k = 0; k < K; ++k) {
            uint4 word = Team::scratch()[32 * (from + m * K + k)];
            h[m][k][0] = word.x;
            h[m][k][1] = word.y;
            h[m][k][2] = word.z;
            h[m][k][3] = word.w;
        }
    }
}

// d += columns 16 k .. 16 k + 15 of h, times a 16 x 16 block of a matrix with the B operands b.
template <int T, int K>
__device__ inline void multiply(uint4 b, const unsigned (&h)[T][K][4], int k, float (&d)[T][2][4]) {
#pragma unroll
    for (int m = 0; m < T; ++m) {
        mma(d[m][0], h[m][k], b.x, b.y);
        mma(d[m][1], h[m][k], b.z, b.w);
    }
}

// Processes the sums d of a layer, at columns 16 n .. 16 n + 15: their sines go to scratch or, in the last layer, times
// the output rows, to `sums`. Their cosines go to slopes [T][K], unless null (no gradient).
template <class Net, class Team, bool LAST, int T>
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
            Team::scratch()[32 * (m * K + n)] = as_input(d[m]);
            if constexpr (Net::SPLIT) {
                subtract_rounded(d[m]);
                Team::scratch()[32 * ((T + m) * K + n)] = as_input(d[m]);
            }
        }
    }
    if constexpr (LAST) {
#pragma unroll
        for (int octet = 0; octet < 2; ++octet) {
            const float *row = net.rows + 16 * n + 8 * octet + 2 * (lane() % 4);
#pragma unroll
            for (int c = 0; c < Net::OUTPUTS; ++c, row += Net::WIDTH) {
                float w0 = __ldg(row), w1 = __ldg(row + 1);
#pragma unroll
                for (int m = 0; m < T; ++m) {
                    sums[c][m][0] += w0 * d[m][octet][0] + w1 * d[m][octet][1];
                    sums[c][m][1] += w0 * d[m][octet][2] + w1 * d[m][octet][3];
                }
            }
        }
    }
}

template <class Net, class Team, bool LAST, int T>
__device__ inline void first_layer(const Packed &net, const vec4 (&points)[T][2], uint4 *slopes,
                                   float (&sums)[Net::OUTPUTS][T][2]) {
#pragma unroll 1
    for (int n = Team::first(); n < Tile<Net>::K; n += Team::WARPS) {
        float d[T][2][4];
#pragma unroll
        for (int octet = 0; octet < 2; ++octet) {
#pragma unroll
            for (int side = 0; side < 2; ++side) {
                int column = 16 * n + 8 * octet + 2 * (lane() % 4) + side;
                vec4 w = as_vec4(__ldg(net.first + column));
                float bias = __ldg(net.bias + column);
#pragma unroll
                for (int m = 0; m < T; ++m) {
                    d[m][octet][side] = dot(w, points[m][0]) + bias;
                    d[m][octet][2 + side] = dot(w, points[m][1]) + bias;
                }
            }
        }
        activate<Net, Team, LAST>(net, n, d, slopes, sums);
    }
}

// The B operands of COUNT matrices, in K chunks of 32 K words, one after the other. Warps alone use the same chunks at the
// same time, and copy them to shared memory in advance. Each warp of a team has chunks of its own.
template <int K, class Team, int COUNT> class Operands {
public:
    __device__ Operands(const uint4 *first, const uint4 *second) : from_{first, second} {
        if constexpr (Team::WARPS == 1) {
            __syncthreads();  // all have used the chunks of the layer before
            for (int n = 0; n < CHUNKS - 1; ++n) begin(n);
        }
    }

    // Waits for chunk n.
    __device__ void await(int n) const {
        if constexpr (Team::WARPS == 1) {
            wait_for_copies<CHUNKS - 2>();
            wait_anywhere<Team::BLOCK>();  // all have copied chunk n, and have used the one before
            begin(n + CHUNKS - 1);
        }
    }

    __device__ uint4 get(int matrix, int n, int k) const {
        if constexpr (Team::WARPS == 1) return Team::chunk(n)[(matrix * K + k) * 32 + lane()];
        return __ldg(from_[matrix] + (n * K + k) * 32 + lane());
    }

private:
    __device__ void begin(int n) const {
        if (n < K) {
#pragma unroll
            for (int i = 0; i < COUNT; ++i) {
                for (int word = static_cast<int>(threadIdx.x); word < 32 * K; word += Team::BLOCK)
                    copy(Team::chunk(n) + i * 32 * K + word, from_[i] + n * 32 * K + word);
            }
        }
        end_copies();
    }

    const uint4 *from_[2];
};

template <class Net, class Team, bool LAST, int T>
__device__ inline void hidden_layer(const Packed &net, int layer, bool active, uint4 *slopes,
                                    float (&sums)[Net::OUTPUTS][T][2]) {
    constexpr int K = Tile<Net>::K;
    // A team's warps take two chunks at once, so that their products depend less on each other.
    constexpr int AT_ONCE = Team::WARPS > 1 && K % (2 * Team::WARPS) == 0 ? 2 : 1;
    int place = (layer - 1) * K * K * 32;
    Operands<K, Team, Net::SPLIT ? 2 : 1> weights(net.forward + place, net.forward_rest + place);
    if (Team::WARPS == 1 && !active) {
        for (int n = 0; n < K; ++n) weights.await(n);
        return;
    }
    unsigned h[T][K][4], rest[Net::SPLIT ? T : 1][Net::SPLIT ? K : 1][4];
    Team::meet();  // all have written them
    load_inputs<Team>(0, h);
    if constexpr (Net::SPLIT) load_inputs<Team>(T * K, rest);
    Team::meet();  // all have read them
#pragma unroll 1
    for (int first = Team::first(); first < K; first += AT_ONCE * Team::WARPS) {
        weights.await(first);
        float d[AT_ONCE][T][2][4];
#pragma unroll
        for (int i = 0; i < AT_ONCE; ++i) {
#pragma unroll
            for (int octet = 0; octet < 2; ++octet) {
                const float *bias = net.bias + layer * Net::WIDTH + 16 * (first + i * Team::WARPS) + 8 * octet + 2 * (lane() % 4);
                float b0 = __ldg(bias), b1 = __ldg(bias + 1);
#pragma unroll
                for (int m = 0; m < T; ++m) {
                    d[i][m][octet][0] = d[i][m][octet][2] = b0;
                    d[i][m][octet][1] = d[i][m][octet][3] = b1;
                }
            }
        }
#pragma unroll
        for (int k = 0; k < K; ++k) {
#pragma unroll
            for (int i = 0; i < AT_ONCE; ++i) {
                uint4 b = weights.get(0, first + i * Team::WARPS, k);
                multiply(b, h, k, d[i]);
                if constexpr (Net::SPLIT) {
                    multiply(b, rest, k, d[i]);
                    multiply(weights.get(1, first + i * Team::WARPS, k), h, k, d[i]);
                }
            }
        }
#pragma unroll
        for (int i = 0; i < AT_ONCE; ++i) activate<Net, Team, LAST>(net, first + i * Team::WARPS, d[i], slopes, sums);
    }
}

// Evaluates the network at T tiles. active: whether this warp has points; if not, it only copies weights. sums: of the
// output rows over this warp's columns. slopes: [LAYERS][T][K] for a gradient, or null.
template <class Net, class Team, int T>
__device__ inline void forward(const Packed &net, const vec4 (&points)[T][2], bool active, uint4 *slopes,
                               float (&sums)[Net::OUTPUTS][T][2]) {
    auto of_layer = [=](int layer) { return slopes == nullptr ? nullptr : slopes + layer * T * Tile<Net>::K; };
    constexpr int LAST = Net::LAYERS - 1;
    if (Team::WARPS > 1 || active) first_layer<Net, Team, LAST == 0>(net, points, of_layer(0), sums);
#pragma unroll 1
    for (int layer = 1; layer < LAST; ++layer)
        hidden_layer<Net, Team, false>(net, layer, active, of_layer(layer), sums);
    if constexpr (LAST > 0) hidden_layer<Net, Team, true>(net, LAST, active, of_layer(LAST), sums);
}

// Outputs of the network at p, this lane's point; the same in all warps of the team. All warps of a block call it.
// active: whether this warp needs them.
template <class Net, class Team>
__device__ inline void evaluate(const Packed &net, vec4 p, float (&outputs)[Net::OUTPUTS], bool active = true) {
    constexpr int T = Team::WARPS == 1 ? Tile<Net>::T : 1;
#pragma unroll
    for (int c = 0; c < Net::OUTPUTS; ++c) outputs[c] = 0.0f;
#pragma unroll 1
    for (int base = 0; base < Team::POINTS; base += 16 * T) {
        vec4 points[T][2];
        spread(p, base, points);
        float sums[Net::OUTPUTS][T][2] = {};
        forward<Net, Team>(net, points, active, nullptr, sums);
#pragma unroll
        for (int c = 0; c < Net::OUTPUTS; ++c) gather(sums[c], base, outputs[c]);
    }
    Team::add(outputs);
#pragma unroll
    for (int c = 0; c < Net::OUTPUTS; ++c) outputs[c] = Net::scale(c) * outputs[c] + Net::offset(c);
}
