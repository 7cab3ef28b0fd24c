#include "simple.cuh"
#include "fused_frame.cuh"
#include "layered_frame.cuh"
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
        : variant_(variant), settings_(a.settings) {
        if (variant != "simple") {
            if (device.major < 8) {
                refuse("--variant %s needs compute capability 8.0, this GPU has %d.%d; use --variant simple",
                       variant.c_str(), device.major, device.minor);
            }
            if (!weights_fit_halves())
                refuse("--variant %s: weights beyond float16's range; use --variant simple", variant.c_str());
        }
        if (variant == "fused" && Alone::SHARED > static_cast<int>(device.sharedMemPerBlockOptin)) {
            refuse("--variant fused: networks too wide for this GPU's shared memory; use --variant simple");
        }
        if (variant == "fused") fused_ = std::make_unique<Fused>(settings_, device.multiProcessorCount);
        if (variant == "layered") {
            cublas_ = Cublas::open();
            if (!cublas_) refuse("--variant layered: libcublas.so is not found; it comes with the CUDA toolkit");
            layered_ = std::make_unique<Layered>(settings_, *cublas_);
            layered_->set_steps(a.steps);
        }
        image_ = std::make_unique<Buffer<vec4>>(static_cast<size_t>(settings_.pixels()));
    }

    // Draws a frame, and calls mark(name) after each stage.
    template <class Mark> void draw(Mark mark) {
        if (fused_) {
            fused_->draw(settings_, image_->get(), mark);
        } else if (layered_) {
            layered_->draw(settings_, image_->get(), mark);
        } else {
            launch(render_simple, blocks_for(settings_.pixels()), settings_, image_->get());
            mark("render");
        }
    }

    void set_rounds(int rounds) { settings_.rounds = rounds; }
    std::vector<vec4> image() const { return image_->read(); }
    Statistics statistics() const { return fused_->statistics(); }
    double executed() const { return layered_ ? layered_->executed() : 0.0; }

private:
    std::string variant_;
    Settings settings_;
    std::unique_ptr<Cublas> cublas_;
    std::unique_ptr<Fused> fused_;
    std::unique_ptr<Layered> layered_;
    std::unique_ptr<Buffer<vec4>> image_;
};
