// layered_frame.cuh: the host side of `layered`.
#include "cublas.cuh"
#include "layered.cuh"

namespace mplicits {

// A network's matrices after the first, [LAYERS - 1][width][width] halves, row by row.
inline std::vector<unsigned> inner_matrices(const Network &network) {
    std::vector<unsigned> halves;
    for (int j = 1; j < network.layers; ++j) {
        for (int o = 0; o < network.width; ++o) {
            for (int i = 0; i < network.width; i += 2)
                halves.push_back(halves_of(network.layer[j].at(o, i), network.layer[j].at(o, i + 1)));
        }
    }
    return halves;
}

class Layered {
public:
    Layered(const Arguments &a, const Cublas &cublas)
        : cublas_(cublas),
          settings_(a.settings),
          steps_(a.steps),
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
          active_(1),
          image_(size()) {
        for (int i = TEXTURED ? 0 : 1; i <= LEVELS; ++i) {
            packings_.emplace_back(NETWORKS[i]);
            networks_.of[i] = packings_.back().upload();
            inner_[i] = std::make_unique<Buffer<unsigned>>(inner_matrices(NETWORKS[i]));
        }
    }

    // Draws a frame, and calls mark(name) after each stage.
    template <class Mark> void draw(Mark mark) {
        const Settings &s = settings_;
        executed_ = 0;
        launch(enter_layered, blocks(), s, state_.get());
        mark("enter");
        bool left = true;
        for (int round = 0; round < s.rounds && left; ++round) {
            for (int phase = 1; phase <= s.level; ++phase) {
                int steps = steps_[static_cast<size_t>(phase - 1)];
                for (int i = 0; i < steps; ++i) step(phase, phase == s.level && i + 1 == steps);
            }
            left = active_.read()[0] > 0;
        }
        mark("trace");
        if (shades_hits(s)) surface();
        launch(shade_layered, blocks(), s, static_cast<const Hit *>(state_.get()),
               static_cast<const vec3 *>(gradient_.get()), static_cast<const float *>(colors_.get()), image_.get());
        mark("shade");
    }

    std::vector<vec4> image() const { return image_.read(); }
    double executed() const { return executed_; }  // floating-point operations of the last frame's products

private:
    size_t size() const { return static_cast<size_t>(settings_.pixels()); }
    int blocks() const { return blocks_for(settings_.pixels()); }
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
    void step(int phase, bool last) {
        launch(place, blocks(), settings_, static_cast<const Hit *>(state_.get()), points_.get());
        for (int level = 1; level <= phase; ++level) {
            forward(level, values_.get() + static_cast<size_t>(level - 1) * size() * 8, false);
        }
        if (last) active_.clear();
        launch(step_layered, blocks(), settings_, phase, static_cast<const float *>(values_.get()), state_.get(),
               last ? active_.get() : nullptr);
    }

    // Evaluates network i at points_: outputs are the sums of its output rows, [pixels][8].
    void forward(int i, float *outputs, bool with_slopes) {
        const Network &network = NETWORKS[i];
        const Packed &packed = networks_.of[i];
        const int width = network.width;
        const long long count = static_cast<long long>(settings_.pixels()) * width;
        product(false, true, width, 4, packed.first, points_.get(), sums_.get());
        for (int j = 0; j < network.layers; ++j) {
            if (j > 0) product(true, true, width, width, matrix(i, j), sines_.get(), sums_.get());
            launch(activate_layered, blocks_for(count / 2), static_cast<const float *>(sums_.get()),
                   packed.bias + j * width, width, count, sines_.get(), j + 1 == network.layers ? sums_.get() : nullptr,
                   with_slopes ? slopes_of(j, width) : nullptr);
        }
        product(false, true, 8, width, packed.rows, sums_.get(), outputs);
    }

    // Evaluates the normal level's gradient and the colors at the rays' ends.
    void surface() {
        launch(place, blocks(), settings_, static_cast<const Hit *>(state_.get()), points_.get());
        for (int level = 1; level <= settings_.normal_level; ++level) {
            forward(level, values_.get(), true);
            backward(level);
            launch(add_gradient, blocks(), static_cast<const float4 *>(level_gradient_.get()), level,
                   networks_.of[level].lift, settings_.pixels(), gradient_.get());
        }
        if (TEXTURED) forward(0, colors_.get(), false);
    }

    // The gradient of network i, from the slopes of forward().
    void backward(int i) {
        const Network &network = NETWORKS[i];
        const Packed &packed = networks_.of[i];
        const int width = network.width;
        const long long count = static_cast<long long>(settings_.pixels()) * width;
        for (int j = network.layers - 1; j >= 0; --j) {
            bool row = j == network.layers - 1;
            launch(scale_adjoint, blocks_for(count / 2), row ? packed.rows : static_cast<const float *>(sums_.get()),
                   row, row ? packed.lift : 1.0f, static_cast<const unsigned *>(slopes_of(j, width)), width, count,
                   sines_.get(), j == 0 ? first_adjoint_.get() : nullptr);
            if (j > 0) product(true, false, width, width, matrix(i, j), sines_.get(), sums_.get());
        }
        product(false, false, 4, width, packed.first, first_adjoint_.get(),
                reinterpret_cast<float *>(level_gradient_.get()));
    }

    // c [pixels][m] = b [pixels][k] times a, in row order: [m][k] if `transposed`, else [k][m].
    void product(bool halves, bool transposed, int m, int k, const void *a, const void *b, float *c) {
        executed_ += 2.0 * m * k * settings_.pixels();
        cublas_.product(halves, transposed, m, settings_.pixels(), k, a, transposed ? k : m, b, c);
    }

    // Matrix j, from 1, of network i.
    const unsigned *matrix(int i, int j) const {
        size_t width = static_cast<size_t>(NETWORKS[i].width);
        return inner_[i]->get() + static_cast<size_t>(j - 1) * width * width / 2;
    }
    unsigned *slopes_of(int j, int width) const {
        return slopes_.get() + static_cast<size_t>(j) * size() * static_cast<size_t>(width) / 2;
    }

    const Cublas &cublas_;
    Settings settings_;
    std::vector<int> steps_;
    Buffer<Hit> state_;
    Buffer<float4> points_;
    Buffer<float> sums_;
    Buffer<unsigned> sines_, slopes_;
    Buffer<float> first_adjoint_, values_, colors_;
    Buffer<float4> level_gradient_;
    Buffer<vec3> gradient_;
    Buffer<int> active_;
    Buffer<vec4> image_;
    std::list<Packing> packings_;
    PackedNetworks networks_ = {};
    std::unique_ptr<Buffer<unsigned>> inner_[LEVELS + 1];
    double executed_ = 0;
};

}  // namespace mplicits
