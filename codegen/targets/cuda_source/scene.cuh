#include "arguments.cuh"
#include "simple.cuh"
#include "timer.cuh"
// scene.cuh: replaces frames.cuh and benchmark.cuh for a scene, which has only the variant simple: the others evaluate
// one shape's networks for many rays at once.
inline bool weights_fit_halves() { return false; }

class Frame {
public:
    Frame(const std::string &variant, const Arguments &a, const cudaDeviceProp &)
        : settings_(a.settings), image_(static_cast<size_t>(a.settings.pixels())) {
        if (variant != "simple") refuse("--variant %s: a scene has only the variant simple", variant.c_str());
    }
    template <class Mark> void draw(Mark mark) {
        launch(render_simple, blocks_for(settings_.pixels()), settings_, image_.get());
        mark("render");
    }
    std::vector<vec4> image() const { return image_.read(); }

private:
    Settings settings_;
    Buffer<vec4> image_;
};

inline void run_benchmark(Arguments a, const cudaDeviceProp &device) {
    printf("{\"model\": \"%s\", \"device\": \"%s\", \"sizes\": [\n", SHA256, device.name);
    std::vector<int> sizes = a.sized ? std::vector<int>{0} : std::vector<int>{512, 1024};
    for (size_t i = 0; i < sizes.size(); ++i) {
        if (sizes[i]) a.settings.resolution = vec2(static_cast<float>(sizes[i]));
        double before = free_memory();
        Frame frame(a.variant.empty() ? "simple" : a.variant, a, device);
        printf("  {\"width\": %d, \"height\": %d, \"variants\": [\n", a.settings.width(), a.settings.height());
        time_frames("simple", frame, a, before - free_memory());
        printf("}\n  ]}%s\n", i + 1 < sizes.size() ? "," : "");
    }
    printf("]}\n");
}
