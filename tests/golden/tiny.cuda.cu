// {"mplicits": "VERSION", "target": "cuda", "name": "tiny \"*/??/\n\\u000a</script>\\", "sha256": "6372a336b13b", "levels": ["4x1", "8x0"]}
// Multiscale neural signed distance function.
//
//     nvcc -O3 -arch=native model.cu -o model && ./model --help
//
// Variants: simple, one thread per ray, float32; fused, tiles of rays on the tensor cores. In order:
// check, vectors, uniforms, camera_ray, settings, the field, networks, shade, arguments, grid, cells,
// half_width, march, background, floor_distance, key_light, openness, softbox, floor_color, colors, simple,
// stepping, mma, packed, team, tile, adjoint, queues, fused, picture, unpack, benchmark, main. Of these,
// camera_ray, shade, cells, half_width, march, background, and all from floor_distance to floor_color, are
// functions of the GLSL targets.

#include <cuda_runtime.h>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <list>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace mplicits {

const char *const MODEL = "tiny \042\052\057\077\077\057\012\134u000a\074\057script\076\134";
const char *const SHA256 = "6372a336b13bcaf757f75535d8370246db0febbffb3a55997d4e9ce2cd34b11d";
constexpr int LEVELS = 2;
constexpr float GROUND = -.9655f;  // of the shape's lowest point
constexpr int MOST_LAYERS = 2;
constexpr bool MOVING = false;  // a field of (x, y, z, t)
#define TEXTURED 1
constexpr int ITERATIONS[LEVELS] = {20, 5};
constexpr float DELTAS[LEVELS] = {1.f, .5f};
constexpr float STEP_BOUNDS[LEVELS] = {.8f, .8f};
constexpr float BAND_STEP_BOUNDS[LEVELS] = {.8f, .8f};
constexpr int CELL_COUNT = 4;  // along an edge of the grid that rays skip
constexpr float CELLS_HALF = 2.f;
constexpr float NEAR = 1.f;  // see skip.glsl
const unsigned CELLS[16] = {
    26368u, 1711807796u, 1879050273u, 2121271376u, 134744072u, 524296u, 2717965824u, 1151140000u, 1011025928u, 148244480u,
    856162312u, 51968u, 0u, 36691u, 2583724800u, 1309184776u,
};

const float WEIGHTS[27][4] = {
    {.913f, -3.223f, .711f, 2.9f},
    {-1.535f, 2.088f, 1.53f, 2.106f},
    {-3.06f, 2.752f, .291f, -3.315f},
    {.715f, -.933f, .459f, -.649f},
    {.89f, -1.155f, .283f, .454f},
    {.102f, -.92f, -.285f, .369f},
    {-.491f, .418f, 1.218f, .462f},
    {-.189f, .361f, 1.178f, -.272f},
    {-.73f, .443f, .051f, -.38f},
    {-.035f, .954f, 1.063f, -.348f},
    {-1.188f, -.723f, .821f, 1.914f},
    {.629f, 2.602f, -2.773f, -1.738f},
    {-1.081f, -1.819f, 2.218f, 2.51f},
    {.344f, -.601f, .884f, -.27f},
    {-2.943f, -.331f, -2.987f, -2.728f},
    {-1.093f, 1.975f, -.636f, .536f},
    {-2.331f, -1.796f, -2.01f, -1.342f},
    {-.789f, .258f, .854f, -.119f},
    {7.874f, -.002f, -1.295f, 2.082f},
    {8.575f, 7.776f, -.692f, 4.464f},
    {.195f, 1.563f, -2.567f, 3.12f},
    {1.905f, 1.408f, 1.527f, -3.235f},
    {-.569f, 2.88f, 2.849f, 2.424f},
    {.962f, .914f, -.702f, .945f},
    {9.551f, 7.897f, -.49f, -6.555f},
    {.739f, 1.037f, -.573f, .095f},
    {-.14f, 1.056f, -1.126f, .568f},
};
__device__ float4 weights[27];

// check.cuh
// vectors.cuh

// The uniforms of the GLSL targets, with their defaults.
struct Uniforms {
    vec2 resolution = vec2(512.f);  // size of the image, pixels; set this one
    mat4 camera = mat4(vec4(1.f, 0.f, 0.f, 0.f), vec4(0.f, 1.f, 0.f, 0.f), vec4(0.f, 0.f, 1.f, 0.f), vec4(0.f, 0.f, 3.4f, 1.f));  // camera to model space: columns right, up, back, eye
    float focal = 2.75f;  // 1 / tan(fov / 2), vertical
    int level = LEVELS;  // traced level
    int normal_level = LEVELS;  // level whose gradient is the normal
    int rounds = 64;  // most passes over the levels
    float step_scale = 1.f;  // further factor on every step; below 1: safer, slower
    int schedule = 1;  // sphere tracing: 0 plain, 1 over-relaxed
    int shading = 0;  // 0 phong, 1 normal, 2 depth, 3 steps, 4 texture, 5 softbox, 6 data: (t, steps, level, hit)
    float ground = GROUND;  // height of the floor of the shading softbox, model space, y up
    vec3 light = vec3(-.5f, .7f, .8f);  // direction to the light, camera space
    vec3 background_bottom = vec3(.13f, .14f, .17f);  // sRGB
    vec3 background_top = vec3(.33f, .36f, .41f);  // sRGB
};
__constant__ int iterations[LEVELS];  // sphere tracing steps at each level, per round
__constant__ float delta[LEVELS];  // band half-width of each level, model units
__constant__ float step_bound[LEVELS];  // factor on each level's steps if it is the traced level
__constant__ float band_step_bound[LEVELS];  // factor on each level's steps if a finer level is traced
__constant__ float time;  // time of a moving model, from 0 to 1
constexpr float DEFAULT_TIME = 0.f;
// Names of the shadings and of the schedules; the index is the uniform's value.
const char *const SHADINGS[] = {"phong", "normal", "depth", "steps", "texture", "softbox", "data"};
const char *const SCHEDULES[] = {"plain", "relaxed"};
// Defaults of --camera and --fov.
constexpr double AZIMUTH = 30.0, ELEVATION = 20.0, FOV = 35.0;  // degrees
constexpr double MARGIN = 1.06;  // the picture shows a sphere of this radius

// settings.cuh

// The field of all targets: p in model space, levels counted from 1.
__device__ inline vec4 as_vec4(float4 v) { return vec4(v.x, v.y, v.z, v.w); }
__device__ inline vec4 texel(int k) { return as_vec4(__ldg(weights + k)); }
__device__ inline mat4 block(int k) { return mat4(texel(k), texel(k + 1), texel(k + 2), texel(k + 3)); }

__device__ inline float network1(vec4 p) {
    vec4 h0;
    for (int k = 0; k < 1; ++k) {
        vec4 s = vec4(0);
        s += block(0 + 4 * k + 4 * (0)) * p;
        vec4 a0 = s;
        h0 = sin(a0);
    }
    float f = 0.;
    for (int k = 0; k < 1; ++k) {
        vec4 s = texel(8 + k);
        s += block(4 + 4 * k + 4 * (0)) * h0;
        vec4 a1 = s;
        vec4 h1 = sin(a1);
        f += dot(texel(9 + k), h1);
    }
    f = 1.f * f + .14306f;
    return f;
}

__device__ inline float network2(vec4 p) {
    float f = 0.;
    for (int k = 0; k < 2; ++k) {
        vec4 s = vec4(0);
        s += block(10 + 4 * k + 4 * (0)) * p;
        vec4 a0 = s;
        vec4 h0 = sin(a0);
        f += dot(texel(18 + k), h0);
    }
    f = .1f * f + -.00515f;
    return f;
}

__device__ inline vec4 network1_gradient(vec4 p) {
    vec4 a0;
    vec4 h0;
    for (int k = 0; k < 1; ++k) {
        vec4 s = vec4(0);
        s += block(0 + 4 * k + 4 * (0)) * p;
        a0 = s;
        h0 = sin(a0);
    }
    float f = 0.;
    vec4 g1;
    for (int k = 0; k < 1; ++k) {
        vec4 s = texel(8 + k);
        s += block(4 + 4 * k + 4 * (0)) * h0;
        vec4 a1 = s;
        vec4 h1 = sin(a1);
        f += dot(texel(9 + k), h1);
        vec4 c1 = cos(a1);
        g1 = texel(9 + k) * c1;
    }
    f = 1.f * f + .14306f;
    vec4 g0;
    for (int k = 0; k < 1; ++k) {
        vec4 s = vec4(0);
        s += g1 * block(4 + 4 * k + 4 * (0));
        vec4 e1 = s;
        vec4 c0 = cos(a0);
        g0 = e1 * c0;
    }
    vec4 gradient;
    for (int k = 0; k < 1; ++k) {
        vec4 s = vec4(0);
        s += g0 * block(0 + 4 * k + 4 * (0));
        gradient = s;
    }
    return vec4(gradient.xyz, f);
}

__device__ inline vec4 network2_gradient(vec4 p) {
    float f = 0.;
    vec4 g0[2];
    for (int k = 0; k < 2; ++k) {
        vec4 s = vec4(0);
        s += block(10 + 4 * k + 4 * (0)) * p;
        vec4 a0 = s;
        vec4 h0 = sin(a0);
        f += dot(texel(18 + k), h0);
        vec4 c0 = cos(a0);
        g0[k] = texel(18 + k) * c0;
    }
    f = .1f * f + -.00515f;
    vec4 gradient;
    for (int k = 0; k < 1; ++k) {
        vec4 s = vec4(0);
        for (int j = 0; j < 2; ++j) {
            s += g0[j] * block(10 + 4 * k + 4 * (j));
        }
        vec4 e0 = s;
        gradient = .1f * e0;
    }
    return vec4(gradient.xyz, f);
}

__device__ inline vec3 network_texture(vec4 p) {
    float r = 0.;
    float g = 0.;
    float b = 0.;
    for (int k = 0; k < 1; ++k) {
        vec4 s = vec4(0);
        s += block(20 + 4 * k + 4 * (0)) * p;
        vec4 a0 = s;
        vec4 h0 = sin(a0);
        r += dot(texel(24 + k), h0);
        g += dot(texel(25 + k), h0);
        b += dot(texel(26 + k), h0);
    }
    r = .1f * r + .22875f;
    g = 1.f * g + -.94327f;
    b = 1.f * b + .43844f;
    return vec3(r, g, b);
}

__device__ inline float field(vec3 p, int level, int &reached) {
    vec4 q = vec4(p, 1.);
    float f = network1(q);
    reached = 1;
    if (reached == 1 && level > 1 && abs(f) < delta[0]) {
        f += network2(q);
        reached = 2;
    }
    return f;
}

__device__ inline vec4 field_gradient(vec3 p, int level) {
    vec4 q = vec4(p, 1.);
    vec4 g = network1_gradient(q);
    if (level > 1) g += network2_gradient(q);
    return g;
}

__device__ inline vec3 albedo(vec3 p) {
    return clamp(network_texture(vec4(p, 1.)), 0., 1.);
}

// networks.cuh

// A level's network at compile time, index: level; 0: the texture.
template <int LEVEL> struct NetworkOf;
template <> struct NetworkOf<0> {
    static constexpr int WIDTH = 16, LAYERS = 1, OUTPUTS = 3;
    static constexpr bool SPLIT = false;
    __device__ static constexpr float scale(int c) { return c == 0 ? .1f : c == 1 ? 1.f : 1.f; }
    __device__ static constexpr float offset(int c) { return c == 0 ? .22875f : c == 1 ? -.94327f : .43844f; }
};
template <> struct NetworkOf<1> {
    static constexpr int WIDTH = 16, LAYERS = 2, OUTPUTS = 1;
    static constexpr bool SPLIT = true;
    __device__ static constexpr float scale(int) { return 1.f; }
    __device__ static constexpr float offset(int) { return .14306f; }
};
template <> struct NetworkOf<2> {
    static constexpr int WIDTH = 16, LAYERS = 1, OUTPUTS = 1;
    static constexpr bool SPLIT = false;
    __device__ static constexpr float scale(int) { return .1f; }
    __device__ static constexpr float offset(int) { return -.00515f; }
};
const Network NETWORKS[3] = {
    {16, 1, 3, {{4, 4, 20, -1}}, {24, 25, 26}, 28},
    {16, 2, 1, {{4, 4, 0, -1}, {4, 4, 4, 8}}, {9}, 36},
    {16, 1, 1, {{8, 4, 10, -1}}, {18}, 40},
};

// main.cuh

}  // namespace mplicits

int main(int count, char **values) { return mplicits::run(count, values); }
