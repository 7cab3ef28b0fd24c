#include "simple.cuh"
#include "fused_frame.cuh"
// frames.cuh: one object for any variant, which draws frames.

// Whether all weights of hidden layers are in float16's range.
inline bool weights_fit_halves() {
    for (int i = TEXTURED ? 0 : 1; i <= LEVELS; ++i) {
        const Network &network = NETWORKS[i];
        for (int j = 1; j < network.layers; ++j) {
            for (int o = 0; o < network.layer[j].rows; ++o) {
                for (int k = 0; k < network.layer[j].columns; ++k) {
                    if (fabsf(network.layer[j].at(o, k)) >= 65504.0f) return false;
                }
            }
        }
    }
    return true;
}

class Frame {
public:
    Frame(const std::string &variant, const Arguments &a, const cudaDeviceProp &device)
        : settings_(a.settings), image_(static_cast<size_t>(a.settings.pixels())) {
        if (variant == "simple") return;
        if (device.major < 8) {
            refuse("--variant fused needs compute capability 8.0, this GPU has %d.%d; use --variant simple",
                   device.major, device.minor);
        }
        if (!weights_fit_halves())
            refuse("--variant fused: weights beyond float16's range; use --variant simple");
        if (Alone::SHARED > static_cast<int>(device.sharedMemPerBlockOptin))
            refuse("--variant fused: networks too wide for this GPU's shared memory; use --variant simple");
        fused_ = std::make_unique<Fused>(settings_, device.multiProcessorCount);
    }

    // Draws a frame, and calls mark(name) after each stage.
    template <class Mark> void draw(Mark mark) {
        if (fused_) {
            fused_->draw(settings_, image_.get(), mark);
        } else {
            launch(render_simple, blocks_for(settings_.pixels()), settings_, image_.get());
            mark("render");
        }
    }

    std::vector<vec4> image() const { return image_.read(); }
    Statistics statistics() const { return fused_->statistics(); }

private:
    Settings settings_;
    std::unique_ptr<Fused> fused_;
    Buffer<vec4> image_;
};
