// Evaluates a baked model's networks at points (float4, float32, from stdin), and writes rows of one float4 per point
// to stdout. The texture's rows, if any, precede those of the levels.
//   for each network, as `fused` evaluates it by a warp alone: (gradient, value), or (color, 0) of the texture;
//   for each network, by the warps of a block together: its outputs in xyz, and in w its first one without the split;
//   for each level, field_gradient(), and then (albedo(), 0), as `simple` calls them.
#define main model_main
#include "model.cu"
#undef main

namespace mplicits {
constexpr int FIRST = 1 - TEXTURED, ROWS = LEVELS + TEXTURED;

// Each block has the points of a team, the same in all its warps.
template <int LEVEL> void probe_together(PackedNetworks networks, const vec4 *points, vec4 *out) {
    using Net = NetworkOf<LEVEL>;
    int place = static_cast<int>(Together::POINTS * blockIdx.x) + lane() % Together::POINTS;
    float values[Net::OUTPUTS], rough[Net::OUTPUTS];
    evaluate<Net, Together>(networks.of[LEVEL], points[place], values);
    evaluate<Rough<Net>, Together>(networks.of[LEVEL], points[place], rough);
    constexpr int LAST = Net::OUTPUTS - 1;
    if (Together::leads() && lane() < Together::POINTS) out[place] = vec4(values[0], values[LAST / 2], values[LAST], rough[0]);
}

template <int LEVEL>
void all_together(const PackedNetworks &networks, const vec4 *points, vec4 *out, int count) {
    launch(probe_together<LEVEL>, Grid(count / Together::POINTS, Together::SHARED, Together::BLOCK), networks, points, out);
    if constexpr (LEVEL < LEVELS) all_together<LEVEL + 1>(networks, points, out + count, count);
}

template <int LEVEL>
void at_level(const PackedNetworks &networks, const vec4 *points, vec4 *out, int count, int place) {
    using Net = NetworkOf<LEVEL>;
    vec4 p = points[place];
    float values[Net::OUTPUTS];
    evaluate<Net, Alone>(networks.of[LEVEL], p, values);
    if constexpr (LEVEL == 0) {
        out[place] = vec4(values[0], values[1], values[2], 0.0f);
    } else {
        out[place] = vec4(evaluate_gradient<Net>(networks.of[LEVEL], p), values[0]);
    }
    if constexpr (LEVEL < LEVELS) at_level<LEVEL + 1>(networks, points, out + count, count, place);
}

void probe(PackedNetworks networks, const vec4 *points, vec4 *out, int count) {
    int place = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
    vec4 p = points[place];
    at_level<FIRST>(networks, points, out, count, place);
    time = p.w;
    for (int level = 1; level <= LEVELS; ++level)
        out[(2 * ROWS + level - 1) * count + place] = field_gradient(p.xyz, level);
    out[(2 * ROWS + LEVELS) * count + place] = vec4(albedo(p.xyz), 0.0f);
}
}  // namespace mplicits

int main() {
    using namespace mplicits;
    std::vector<vec4> points;
    for (vec4 p; fread(&p, sizeof p, 1, stdin) == 1;) points.push_back(p);
    int count = static_cast<int>(points.size());
    memcpy(weights, WEIGHTS, sizeof WEIGHTS);
    std::list<Packing> packings;
    PackedNetworks networks = {};
    for (int i = FIRST; i <= LEVELS; ++i) {
        packings.emplace_back(NETWORKS[i]);
        networks.of[i] = packings.back().upload();
    }
    Buffer<vec4> in(points), out(static_cast<size_t>((2 * ROWS + LEVELS + 1) * count));
    const vec4 *all = in.get();
    launch(probe, Grid(count / THREADS, Alone::SHARED), networks, all, out.get(), count);
    all_together<FIRST>(networks, all, out.get() + ROWS * count, count);
    std::vector<vec4> rows = out.read();
    fwrite(rows.data(), sizeof(vec4), rows.size(), stdout);
}
