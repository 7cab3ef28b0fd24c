#include "mma.cuh"
// packed.cuh: the weights in the tensor cores' layout, from WEIGHTS, once at the start. A network has its first layer
// (4 to WIDTH, float32), LAYERS - 1 matrices (WIDTH to WIDTH, float16) and its output rows (float32). Zeros pad
// narrower layers. WIDTH is a multiple of 16.
struct Packed {
    const float4 *first;   // [WIDTH] rows of the first matrix
    const float *bias;     // [LAYERS][WIDTH]
    const float *rows;     // [8][WIDTH] output rows, zero after the first OUTPUTS
    const uint4 *forward;  // [LAYERS - 1][WIDTH / 16 outputs][WIDTH / 16 inputs][32 lanes] B of two neighbors
    const uint4 *forward_rest;  // the same of the matrices' rounding errors
    const uint4 *backward;      // the same of the transposed matrices
    float lift;  // power of two that scales the largest entry of the rows into [1, 2)
};

struct PackedNetworks {
    Packed of[LEVELS + 1];  // index: level; 0: the texture
};

// The bits of a float as a half, rounded to nearest even like the GPU, including subnormal and too large numbers.
inline unsigned half_of(float value) {
    unsigned bits;
    memcpy(&bits, &value, sizeof bits);
    unsigned sign = bits >> 16 & 0x8000u;
    float size = fabsf(value);
    if (size >= 65520.0f) return sign | 0x7c00u;
    if (size < 6.103515625e-5f) return sign | static_cast<unsigned>(nearbyintf(size * 16777216.0f));
    bits = (bits & 0x7fffffffu) - (112u << 23);
    return sign | (bits + 0xfffu + (bits >> 13 & 1u)) >> 13;
}

inline float float_of(unsigned half) {
    int exponent = static_cast<int>(half >> 10 & 31u), mantissa = static_cast<int>(half & 1023u);
    float size = exponent == 0 ? ldexpf(static_cast<float>(mantissa), -24)
                               : ldexpf(static_cast<float>(1024 + mantissa), exponent - 25);
    return half & 0x8000u ? -size : size;
}

inline unsigned halves_of(float low, float high) { return half_of(low) | half_of(high) << 16; }

// One network's weights on the host and, after upload(), on the device. The destructor frees both.
class Packing {
public:
    explicit Packing(const Network &network) : width_(network.width) {
        size_t width = static_cast<size_t>(width_);
        first_.assign(width, float4{0, 0, 0, 0});
        bias_.assign(static_cast<size_t>(network.layers) * width, 0.0f);
        rows_.assign(8 * width, 0.0f);
        for (int o = 0; o < network.layer[0].rows; ++o) {
            float row[4];
            for (int i = 0; i < 4; ++i) row[i] = network.layer[0].at(o, i);
            first_[static_cast<size_t>(o)] = float4{row[0], row[1], row[2], row[3]};
        }
        for (int j = 0; j < network.layers; ++j) {
            const Layer &layer = network.layer[j];
            if (layer.bias < 0) continue;
            for (int o = 0; o < layer.rows; ++o) bias_[static_cast<size_t>(j * width_ + o)] = layer.shift(o);
        }
        for (int j = 1; j < network.layers; ++j) {
            const Layer &layer = network.layer[j];
            fragments([&](int i, int o) { return layer.at(o, i); }, forward_);
            fragments([&](int i, int o) { return layer.at(o, i) - float_of(half_of(layer.at(o, i))); }, forward_rest_);
            fragments([&](int i, int o) { return layer.at(i, o); }, backward_);
        }
        output_rows(network);
    }

    Packed upload() {
        return Packed{keep(first_),   keep(bias_),         keep(rows_),
                      keep(forward_), keep(forward_rest_), keep(backward_), lift_};
    }

private:
    // Appends the B operands of a matrix, entry(input, output), lane by lane: of two neighboring mma with the outputs
    // 16 n .. 16 n + 15 as columns and the inputs 16 k .. 16 k + 15 as rows.
    template <class Entry> void fragments(Entry entry, std::vector<uint4> &out) {
        for (int n = 0; n < width_ / 16; ++n) {
            for (int k = 0; k < width_ / 16; ++k) {
                for (int lane = 0; lane < 32; ++lane) {
                    unsigned registers[4];
                    for (int part = 0; part < 4; ++part) {
                        int output = 16 * n + 8 * (part / 2) + lane / 4,
                            input = 16 * k + 8 * (part % 2) + 2 * (lane % 4);
                        registers[part] = halves_of(entry(input, output), entry(input + 1, output));
                    }
                    out.push_back(uint4{registers[0], registers[1], registers[2], registers[3]});
                }
            }
        }
    }

    void output_rows(const Network &network) {
        float largest = 0.0f;
        for (int c = 0; c < network.outputs; ++c) {
            for (int i = 0; i < network.layer[network.layers - 1].rows; ++i) {
                float entry = WEIGHTS[network.row[c] + i / 4][i % 4];
                rows_[static_cast<size_t>(c * width_ + i)] = entry;
                largest = fmaxf(largest, fabsf(entry));
            }
        }
        lift_ = largest > 0.0f ? exp2f(-floorf(log2f(largest))) : 1.0f;
    }

    template <class T> const T *keep(const std::vector<T> &values) {
        if (values.empty()) return nullptr;
        auto buffer = std::make_shared<Buffer<T>>(values);
        kept_.push_back(buffer);
        return buffer->get();
    }

    int width_;
    float lift_ = 1.0f;
    std::vector<float4> first_;
    std::vector<float> bias_, rows_;
    std::vector<uint4> forward_, forward_rest_, backward_;
    std::vector<std::shared_ptr<void>> kept_;
};
