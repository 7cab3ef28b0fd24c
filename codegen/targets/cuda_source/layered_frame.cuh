#include "layered.cuh"
// layered_frame.cuh: the host side of `layered`.
class Layered {
public:
    Layered(const Settings &s, const Cublas &cublas)
        : cublas_(cublas),
          pixels_(s.pixels()),
          state_(size()),
          points_(size()),
          sums_(size() * widest()),
          sines_(size() * widest() / 2),
          slopes_(size() * widest() / 2 * most_layers()),
          first_adjoint_(size() * widest()),
          values_(size() * LEVELS * 8),
          colors_(TEXTURED ? size() * 8 : 1),
          level_gradient_(size()),
          gradient_(size()),
          active_(1) {
        for (int i = TEXTURED ? 0 : 1; i <= LEVELS; ++i) {
            packings_.emplace_back(NETWORKS[i]);
            networks_.of[i] = packings_.back().upload();
            for (int c = 0; c < NETWORKS[i].outputs; ++c) {
                affine_.scale[i][c] = NETWORKS[i].scale[c];
                affine_.offset[i][c] = NETWORKS[i].offset[c];
            }
        }
    }

    // Draws a frame, and calls mark(name) after each stage.
    template <class Mark> void draw(const Settings &s, vec4 *image, Mark mark) {
        executed_ = 0;
        launch(enter_layered, blocks(), s, state_.get());
        mark("enter");
        bool left = true;
        for (int round = 0; round < s.rounds && left; ++round) {
            for (int phase = 1; phase <= s.level; ++phase) {
                for (int i = 0; i < steps_[phase - 1]; ++i)
                    step(s, phase, phase == s.level && i + 1 == steps_[phase - 1]);
            }
            left = active_.read()[0] > 0;
        }
        mark("trace");
        if (shades_hits(s)) surface(s);
        launch(shade_layered, blocks(), s, static_cast<const Hit *>(state_.get()),
               static_cast<const vec3 *>(gradient_.get()), static_cast<const float *>(colors_.get()), affine_, image);
        mark("shade");
    }

    void set_steps(const std::vector<int> &steps) { steps_ = steps; }
    double executed() const { return executed_; }  // floating-point operations of the last frame's products

private:
    size_t size() const { return static_cast<size_t>(pixels_); }
    int blocks() const { return blocks_for(pixels_); }
    static size_t widest() {
        int width = 0;
        for (const Network &network : NETWORKS) width = std::max(width, network.width);
        return static_cast<size_t>(width);
    }
    static size_t most_layers() {
        int layers = 0;
        for (const Network &network : NETWORKS) layers = std::max(layers, network.layers);
        return static_cast<size_t>(layers);
    }

    // One step of the rays at level `phase`. last: whether it ends a round; it then counts the unfinished rays.
    void step(const Settings &s, int phase, bool last) {
        launch(place, blocks(), s, static_cast<const Hit *>(state_.get()), points_.get());
        for (int level = 1; level <= phase; ++level) {
            forward(level, values_.get() + static_cast<size_t>(level - 1) * size() * 8, false);
        }
        if (last) active_.clear();
        launch(step_layered, blocks(), s, phase, static_cast<const float *>(values_.get()), affine_, state_.get(),
               last ? active_.get() : nullptr);
    }

    // Evaluates network i at points_: outputs are the sums of its output rows, [pixels][8].
    void forward(int i, float *outputs, bool with_slopes) {
        const Network &network = NETWORKS[i];
        const Packed &packed = networks_.of[i];
        const int width = network.width;
        const long long count = static_cast<long long>(pixels_) * width;
        product(false, true, width, 4, packed.first, points_.get(), sums_.get());
        for (int j = 0; j < network.layers; ++j) {
            if (j > 0) {
                product(true, true, width, width, packed.whole + static_cast<size_t>(j - 1) * half_matrix(width),
                        sines_.get(), sums_.get());
            }
            launch(activate_layered, blocks_for(count / 2), static_cast<const float *>(sums_.get()),
                   packed.bias + j * width, width, count, sines_.get(), j + 1 == network.layers ? sums_.get() : nullptr,
                   with_slopes ? slopes_of(j, width) : nullptr);
        }
        product(false, true, 8, width, packed.rows, sums_.get(), outputs);
    }

    // Evaluates the normal level's gradient and the colors at the rays' ends.
    void surface(const Settings &s) {
        launch(place, blocks(), s, static_cast<const Hit *>(state_.get()), points_.get());
        for (int level = 1; level <= s.normal_level; ++level) {
            forward(level, values_.get(), true);
            backward(level);
            launch(add_gradient, blocks(), static_cast<const float4 *>(level_gradient_.get()),
                   affine_.scale[level][0] / networks_.of[level].lift, level == 1, pixels_, gradient_.get());
        }
        if (TEXTURED) forward(0, colors_.get(), false);
    }

    // The gradient of network i, from the slopes of forward().
    void backward(int i) {
        const Network &network = NETWORKS[i];
        const Packed &packed = networks_.of[i];
        const int width = network.width;
        const long long count = static_cast<long long>(pixels_) * width;
        for (int j = network.layers - 1; j >= 0; --j) {
            bool row = j == network.layers - 1;
            launch(scale_adjoint, blocks_for(count / 2), row ? packed.rows : static_cast<const float *>(sums_.get()),
                   row, row ? packed.lift : 1.0f, static_cast<const unsigned *>(slopes_of(j, width)), width, count,
                   sines_.get(), j == 0 ? first_adjoint_.get() : nullptr);
            if (j > 0) {
                product(true, false, width, width, packed.whole + static_cast<size_t>(j - 1) * half_matrix(width),
                        sines_.get(), sums_.get());
            }
        }
        product(false, false, 4, width, packed.first, first_adjoint_.get(),
                reinterpret_cast<float *>(level_gradient_.get()));
    }

    // c [pixels][m] = b [pixels][k] times a, in row order: [m][k] if `transposed`, else [k][m].
    void product(bool halves, bool transposed, int m, int k, const void *a, const void *b, float *c) {
        executed_ += 2.0 * m * k * pixels_;
        cublas_.product(halves, transposed, m, pixels_, k, a, transposed ? k : m, b, c);
    }

    static size_t half_matrix(int width) { return static_cast<size_t>(width) * static_cast<size_t>(width) / 2; }
    unsigned *slopes_of(int j, int width) const {
        return slopes_.get() + static_cast<size_t>(j) * size() * static_cast<size_t>(width) / 2;
    }

    const Cublas &cublas_;
    int pixels_;
    Buffer<Hit> state_;
    Buffer<float4> points_;
    Buffer<float> sums_;
    Buffer<unsigned> sines_, slopes_;
    Buffer<float> first_adjoint_, values_, colors_;
    Buffer<float4> level_gradient_;
    Buffer<vec3> gradient_;
    Buffer<int> active_;
    std::vector<int> steps_;
    std::list<Packing> packings_;
    PackedNetworks networks_ = {};
    Affines affine_ = {};
    double executed_ = 0;
};
