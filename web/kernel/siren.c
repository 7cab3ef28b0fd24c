// A training step of a SIREN (Eq. 2), for WebAssembly with 128-bit SIMD: the loss of a batch, and its derivative by the
// weights. The method is that of trainer/networks/network.py and losses.py: value and gradient by an adjoint pass, and
// the derivative of that pass by the weights, without automatic differentiation.
//
// The kernel works on tiles of TILE points. An array is [neuron][point], so a vector holds one neuron at four points.
// Inputs are (x, y, z, time). Widths are multiples of 4: the host adds neurons whose weights are zero; they stay zero.
// Weights are one array: W_0 (width, 4), b_0, then W_j (width, width) and b_j of each hidden layer, then the output
// layer (outputs, width) and its biases. Their gradient is an array of the same shape.
//
// The last part makes matrices orthogonal, for the optimizer's step.

#include <wasm_simd128.h>

#define EXPORT __attribute__((visibility("default")))
#define INLINE static inline __attribute__((always_inline)) // the only functions that web/compile_kernel.py inlines

typedef float Floats __attribute__((vector_size(16)));
typedef int Ints __attribute__((vector_size(16)));

enum { TILE = 64, VECTORS = TILE / 4, INPUTS = 4, MOST_LAYERS = 8, MOST_OUTPUTS = 3, TERMS = 5 };

typedef Floats Row[VECTORS]; // one neuron, or one coordinate, at the points of a tile

typedef struct {
    float point[INPUTS], f, slope[3], distance, normal[3];
} LevelSample; // f, slope: the field of the levels before, and its gradient. A distance of NaN is unknown. Off the
               // surface, a hard sample has a normal; its distance does not count in the loss that is told.

typedef struct {
    float point[INPUTS], direction[INPUTS], color[3], unused;
} TextureSample; // direction: the gradient of the field

// Factors of the loss: `LossWeights` of trainer/config.py.
static struct { float value, normal, distance, eikonal, length, excess, lacking, near; } factors;
static const float LACK = 0.3f, SHORTEST = 1e-8f; // as in trainer/networks/losses.py

static int width, depth, outputs;
static float *weights, *gradient, *transposed, *results, terms[TERMS];
static void *samples;

static Row *hidden[MOST_LAYERS + 1]; // the inputs, then the sines of each layer
static Row *cosines[MOST_LAYERS];
static Row *slopes[MOST_LAYERS + 1]; // level: df / d hidden[j]; texture: derivative of hidden[j] along the direction
static Row *bends[MOST_LAYERS];      // level: dL / d cosines[j]; texture: W_j times slopes[j]
static Row *first, *second;          // scratch

static int columns(int layer) { return layer ? width : INPUTS; }
static float *matrix(float *of, int layer) {
    return layer ? of + (INPUTS + 1 + (layer - 1) * (width + 1)) * width : of;
}
static float *biases(float *of, int layer) { return matrix(of, layer) + columns(layer) * width; }
static float *output_matrix(float *of) { return matrix(of, depth + 1); }
static float *output_biases(float *of) { return output_matrix(of) + outputs * width; }

// --- Memory

extern unsigned char __heap_base;
static unsigned long top;

static void *take(unsigned long bytes) {
    unsigned long start = top, pages = __builtin_wasm_memory_size(0);
    top = (top + bytes + 15) & ~15ul;
    unsigned long missing = (top + 65535) / 65536 - pages;
    if ((long)missing > 0 && __builtin_wasm_memory_grow(0, missing) == ~0ul) __builtin_trap();
    return (void *)start;
}

// Prepares for a network of at most MOST_LAYERS sine layers, and for at most `most` samples, a multiple of TILE.
// All addresses change. new_depth: hidden layers after the first.
EXPORT void prepare(int new_width, int new_depth, int new_outputs, int most) {
    width = new_width, depth = new_depth, outputs = new_outputs;
    top = ((unsigned long)&__heap_base + 15) & ~15ul;
    unsigned long parameters = (INPUTS + 1) * width + depth * (width + 1) * width + outputs * (width + 1);
    unsigned long rows = width * sizeof(Row);
    weights = take(4 * parameters), gradient = take(4 * parameters), transposed = take(4 * width * width);
    samples = take(most * sizeof(LevelSample)), results = take(4 * 4 * most);
    hidden[0] = take(INPUTS * sizeof(Row)), slopes[0] = take(rows);
    for (int j = 0; j <= depth; ++j)
        hidden[j + 1] = take(rows), cosines[j] = take(rows), slopes[j + 1] = take(rows), bends[j] = take(rows);
    first = take(rows), second = take(rows);
}

EXPORT float *weights_at(void) { return weights; }
EXPORT float *gradient_at(void) { return gradient; }
EXPORT void *samples_at(void) { return samples; }
EXPORT float *results_at(void) { return results; } // (value, gradient) of each sample, or (color, unused)
EXPORT float *terms_at(void) { return terms; }
EXPORT float *factors_at(void) { return &factors.value; }

// --- Vectors

INLINE Floats all(float x) { return (Floats){x, x, x, x}; }
static float sum(Floats x) { return (x[0] + x[1]) + (x[2] + x[3]); }
static float row_sum(const Floats *row) {
    Floats total = all(0);
    for (int p = 0; p < VECTORS; ++p) total += row[p];
    return sum(total);
}
static Floats select(Ints mask, Floats yes, Floats no) { return (Floats)(((Ints)yes & mask) | ((Ints)no & ~mask)); }

// Sine and cosine, by the nearest multiple of pi / 2 and the polynomials of Cephes (Moshier); error 1e-7.
INLINE void sine_cosine(Floats x, Floats *sine, Floats *cosine) {
    Floats turns = (Floats)wasm_f32x4_nearest((v128_t)(x * all(0.63661977236758134f)));
    Floats r = x - turns * all(1.5703125f) - turns * all(4.837512969970703125e-4f) - turns * all(7.549789948768648e-8f);
    Floats q = r * r;
    Floats s = ((all(-1.9515295891e-4f) * q + all(8.3321608736e-3f)) * q - all(1.6666654611e-1f)) * (q * r) + r;
    Floats c = ((all(2.443315711809948e-5f) * q - all(1.388731625493765e-3f)) * q + all(4.166664568298827e-2f));
    c = c * (q * q) - all(0.5f) * q + all(1.0f);
    Ints quarter = (Ints)wasm_i32x4_trunc_sat_f32x4((v128_t)turns), odd = -(quarter & 1);
    *sine = (Floats)((Ints)select(odd, c, s) ^ ((quarter & 2) << 30));
    *cosine = (Floats)((Ints)select(odd, s, c) ^ (((quarter + 1) & 2) << 30));
}

// to = W from + b, for W (width, n) and n rows. b: or null.
static void multiply(Row *to, const float *w, const float *b, Row *from, int n) {
    for (int o = 0; o < width; o += 4)
        for (int p = 0; p < VECTORS; p += 2) { // 4 rows by 2 vectors: 8 sums stay in registers
            Floats sums[4][2];
            for (int i = 0; i < 4; ++i) sums[i][0] = sums[i][1] = all(b ? b[o + i] : 0);
            for (int k = 0; k < n; ++k)
                for (int i = 0; i < 4; ++i) {
                    Floats factor = all(w[(o + i) * n + k]);
                    sums[i][0] += factor * from[k][p], sums[i][1] += factor * from[k][p + 1];
                }
            for (int i = 0; i < 4; ++i) to[o + i][p] = sums[i][0], to[o + i][p + 1] = sums[i][1];
        }
}

// to = W^T from, for W (width, width).
static void multiply_transposed(Row *to, const float *w, Row *from) {
    for (int o = 0; o < width; ++o)
        for (int i = 0; i < width; ++i) transposed[i * width + o] = w[o * width + i];
    multiply(to, transposed, 0, from, width);
}

// g += a b^T, for g (width, n): sums over the points of a tile.
static void add_products(float *g, Row *a, Row *b, int n) {
    for (int o = 0; o < width; o += 2)
        for (int i = 0; i < n; i += 4) {
            Floats sums[2][4];
            for (int k = 0; k < 8; ++k) sums[k / 4][k % 4] = all(0);
            for (int p = 0; p < VECTORS; ++p)
                for (int k = 0; k < 8; ++k) sums[k / 4][k % 4] += a[o + k / 4][p] * b[i + k % 4][p];
            for (int k = 0; k < 8; ++k) g[(o + k / 4) * n + i + k % 4] += sum(sums[k / 4][k % 4]);
        }
}

// --- Passes over a tile
// Local names of the arrays let the compiler keep their addresses in registers.

#define EACH(o, p) for (int o = 0; o < width; ++o) for (int p = 0; p < VECTORS; ++p)

static void product(Row *to, Row *a, Row *b) { EACH(o, p) to[o][p] = a[o][p] * b[o][p]; }

// Fills hidden and cosines. points: of the first of TILE samples; all samples are of one size.
static void forward(const float *points) {
    for (int p = 0; p < TILE; ++p)
        for (int k = 0; k < INPUTS; ++k) hidden[0][k][p / 4][p % 4] = points[p * sizeof(LevelSample) / 4 + k];
    for (int j = 0; j <= depth; ++j) {
        Row *angle = first, *sine = hidden[j + 1], *cosine = cosines[j];
        multiply(angle, matrix(weights, j), biases(weights, j), hidden[j], columns(j));
        EACH(o, p) sine_cosine(angle[o][p], &sine[o][p], &cosine[o][p]);
    }
}

static void outputs_of(Row *values, Row *rows, int with_biases) {
    for (int c = 0; c < outputs; ++c)
        for (int p = 0; p < VECTORS; ++p) {
            Floats total = all(with_biases ? output_biases(weights)[c] : 0);
            for (int o = 0; o < width; ++o) total += all(output_matrix(weights)[c * width + o]) * rows[o][p];
            values[c][p] = total;
        }
}

// Fills slopes, from the output down, and returns the gradient (INPUTS rows).
static void adjoint(Row *slope) {
    Row *top_slope = slopes[depth + 1];
    EACH(o, p) top_slope[o][p] = all(output_matrix(weights)[o]);
    for (int j = depth; j > 0; --j) {
        product(first, slopes[j + 1], cosines[j]);
        multiply_transposed(slopes[j], matrix(weights, j), first);
    }
    product(first, slopes[1], cosines[0]);
    for (int k = 0; k < INPUTS; ++k) {
        for (int p = 0; p < VECTORS; ++p) slope[k][p] = all(0);
        for (int o = 0; o < width; ++o)
            for (int p = 0; p < VECTORS; ++p) slope[k][p] += all(weights[INPUTS * o + k]) * first[o][p];
    }
}

// Adds the derivative by the weights. d_f (1 row), d_slope (INPUTS rows): derivatives by value and gradient.
static void level_derivative(Row *d_f, Row *d_slope) {
    // Up, through the adjoint pass: `first` is df / d angle, `second` the derivative of the loss by it.
    product(first, slopes[1], cosines[0]);
    add_products(gradient, first, d_slope, INPUTS);
    multiply(second, weights, 0, d_slope, INPUTS);
    for (int j = 0;; ++j) {
        product(bends[j], second, slopes[j + 1]);
        product(second, second, cosines[j]);
        if (j == depth) break;
        product(first, slopes[j + 2], cosines[j + 1]);
        add_products(matrix(gradient, j + 1), first, second, width);
        multiply(first, matrix(weights, j + 1), 0, second, width);
        Row *swap = first; first = second; second = swap;
    }
    for (int o = 0; o < width; ++o) {
        Row *sine = hidden[depth + 1], *d_sine = second;
        Floats total = all(0), factor = all(output_matrix(weights)[o]);
        for (int p = 0; p < VECTORS; ++p) {
            total += d_sine[o][p] + d_f[0][p] * sine[o][p];
            d_sine[o][p] = d_f[0][p] * factor;
        }
        output_matrix(gradient)[o] += sum(total);
    }
    output_biases(gradient)[0] += row_sum(d_f[0]);
    // Down, through the values: `second` is the derivative of the loss by hidden[j + 1], then by the angle.
    for (int j = depth; j >= 0; --j) {
        Row *d = second, *cosine = cosines[j], *bend = bends[j], *sine = hidden[j + 1];
        EACH(o, p) d[o][p] = d[o][p] * cosine[o][p] - bend[o][p] * sine[o][p];
        for (int o = 0; o < width; ++o) biases(gradient, j)[o] += row_sum(second[o]);
        add_products(matrix(gradient, j), second, hidden[j], columns(j));
        if (j) multiply_transposed(first, matrix(weights, j), second);
        Row *swap = first; first = second; second = swap;
    }
}

// Fills slopes with the derivatives of the hidden layers along the samples' directions.
static void along(const TextureSample *sample) {
    for (int p = 0; p < TILE; ++p)
        for (int k = 0; k < INPUTS; ++k) slopes[0][k][p / 4][p % 4] = sample[p].direction[k];
    for (int j = 0; j <= depth; ++j) {
        multiply(bends[j], matrix(weights, j), 0, slopes[j], columns(j));
        EACH(o, p) slopes[j + 1][o][p] = bends[j][o][p] * cosines[j][o][p];
    }
}

// Adds the derivative by the weights. d_value, d_along: by the outputs, and by their derivatives along the directions.
static void texture_derivative(Row *d_value, Row *d_along) {
    for (int c = 0; c < outputs; ++c) {
        for (int o = 0; o < width; ++o) {
            Floats total = all(0);
            for (int p = 0; p < VECTORS; ++p)
                total += d_value[c][p] * hidden[depth + 1][o][p] + d_along[c][p] * slopes[depth + 1][o][p];
            output_matrix(gradient)[c * width + o] += sum(total);
        }
        output_biases(gradient)[c] += row_sum(d_value[c]);
    }
    EACH(o, p) {
        first[o][p] = second[o][p] = all(0);
        for (int c = 0; c < outputs; ++c) {
            first[o][p] += d_value[c][p] * all(output_matrix(weights)[c * width + o]);
            second[o][p] += d_along[c][p] * all(output_matrix(weights)[c * width + o]);
        }
    }
    // Down: `first` is the derivative of the loss by hidden[j + 1], then by the angle; `second` by slopes[j + 1].
    for (int j = depth; j >= 0; --j) {
        EACH(o, p) {
            Floats bend = bends[j][o][p] * second[o][p];
            first[o][p] = first[o][p] * cosines[j][o][p] - bend * hidden[j + 1][o][p];
            second[o][p] *= cosines[j][o][p];
        }
        for (int o = 0; o < width; ++o) biases(gradient, j)[o] += row_sum(first[o]);
        add_products(matrix(gradient, j), first, hidden[j], columns(j));
        add_products(matrix(gradient, j), second, slopes[j], columns(j));
        if (!j) break;
        multiply_transposed(bends[j], matrix(weights, j), first);
        multiply_transposed(first, matrix(weights, j), second);
        Row *swap = second; second = first; first = bends[j]; bends[j] = swap;
    }
}

// --- Steps

static float length_of(const float *v) {
    float length = __builtin_sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    return length < SHORTEST ? SHORTEST : length;
}

// Adds the loss of one sample to the terms (Eq. 4, `level_loss` of trainer/level.py). Returns its derivative by f, and
// sets d_g to that by g. f, g: the field and its gradient there. surface, volume: numbers of samples of the whole
// batch, which may be spread over several kernels.
static float level_loss(
    const LevelSample *s, int on_surface, float f, const float *g, float surface, float volume, float *d_g
) {
    float length = length_of(g), stretch = length - 1, share = 1 / (surface + volume), d_f;
    float error = s->distance == s->distance ? f - s->distance : 0;
    float eikonal = factors.eikonal * (on_surface ? factors.length : 1) * 2 * share * stretch / length;
    for (int k = 0; k < 3; ++k) d_g[k] = eikonal * g[k];
    terms[3] += stretch * stretch * share;
    if (on_surface) {
        float cosine = (g[0] * s->normal[0] + g[1] * s->normal[1] + g[2] * s->normal[2]) / length;
        float factor = factors.normal / (surface * length);
        for (int k = 0; k < 3; ++k) d_g[k] += factor * (g[k] / length * cosine - s->normal[k]);
        terms[0] += error * error / surface, terms[1] += (1 - cosine) / surface;
        terms[4] += __builtin_fabsf(error) / surface;
        d_f = factors.value * 2 / surface * error;
    } else {
        float size = __builtin_fabsf(s->distance), outward = s->distance < 0 ? -f : s->distance > 0 ? f : 0, factor = 1;
        if (__builtin_fabsf(f) > size && size > factors.near) factor = factors.excess;
        if (factors.lacking != 1 && outward < LACK * size) factor = factors.lacking;
        if (!s->normal[0]) terms[2] += factor * error * error / volume;
        d_f = factors.distance * 2 / volume * factor * error;
    }
    return d_f;
}

static void clear_gradient(void) {
    for (float *g = gradient; g < output_biases(gradient) + outputs; ++g) *g = 0;
    for (int k = 0; k < TERMS; ++k) terms[k] = 0;
}

// Sets the gradient, the terms value, normal, distance, eikonal, and the mean |f| on the surface, to the part of `count` samples, a multiple of
// TILE; the first `on` of them lie on the surface. surface, volume: numbers of samples of the whole batch.
EXPORT void level_step(int count, int on, float surface, float volume) {
    Row f[1], slope[INPUTS], d_f[1], d_slope[INPUTS];
    clear_gradient();
    for (int start = 0; start < count; start += TILE) {
        const LevelSample *sample = (const LevelSample *)samples + start;
        forward(sample->point);
        outputs_of(f, hidden[depth + 1], 1);
        adjoint(slope);
        for (int p = 0; p < TILE; ++p) {
            int v = p / 4, lane = p % 4;
            float g[3], d_g[3];
            for (int k = 0; k < 3; ++k) g[k] = slope[k][v][lane] + sample[p].slope[k];
            float value = f[0][v][lane] + sample[p].f;
            d_f[0][v][lane] = level_loss(&sample[p], start + p < on, value, g, surface, volume, d_g);
            for (int k = 0; k < 3; ++k) d_slope[k][v][lane] = d_g[k];
            d_slope[3][v][lane] = 0;
        }
        level_derivative(d_f, d_slope);
    }
}

// The same for a texture (`texture_loss` of trainer/texture.py); the terms are color and along.
EXPORT void texture_step(int count, int on, float surface, float all_samples, float smoothness) {
    Row colors[MOST_OUTPUTS], changes[MOST_OUTPUTS], d_colors[MOST_OUTPUTS], d_changes[MOST_OUTPUTS];
    clear_gradient();
    for (int start = 0; start < count; start += TILE) {
        const TextureSample *sample = (const TextureSample *)samples + start;
        forward(sample->point);
        along(sample);
        outputs_of(colors, hidden[depth + 1], 1);
        outputs_of(changes, slopes[depth + 1], 0);
        for (int c = 0; c < outputs; ++c)
            for (int p = 0; p < TILE; ++p) {
                int v = p / 4, lane = p % 4;
                float error = start + p < on ? colors[c][v][lane] - sample[p].color[c] : 0;
                float change = changes[c][v][lane];
                terms[0] += error * error / surface, terms[1] += change * change / all_samples;
                d_colors[c][v][lane] = error * 2 / surface;
                d_changes[c][v][lane] = smoothness * 2 / all_samples * change;
            }
        texture_derivative(d_colors, d_changes);
    }
}

// Evaluates the network at `count` samples, a multiple of TILE: (f, gradient), or (color, unused) of a texture.
EXPORT void evaluate(int count) {
    Row values[MOST_OUTPUTS], slope[INPUTS];
    for (int start = 0; start < count; start += TILE) {
        forward(((const LevelSample *)samples)[start].point);
        outputs_of(values, hidden[depth + 1], 1);
        if (outputs == 1) adjoint(slope);
        for (int p = 0; p < TILE; ++p) {
            float *result = results + 4 * (start + p);
            for (int k = 0; k < 4; ++k) {
                const Floats *row = outputs > 1 ? values[k % MOST_OUTPUTS] : k ? slope[k - 1] : values[0];
                result[k] = row[p / 4][p % 4];
            }
        }
    }
}

// --- Orthogonal matrices, in an instance of the kernel that has no network

static int matrix_count, size;
static float *matrices, *gram, *polynomial, *next;

// Makes room for `count` matrices (n, n), and returns their address. n: a multiple of 4.
EXPORT float *prepare_matrices(int count, int n) {
    unsigned long bytes = 4 * n * n;
    matrix_count = count, size = n;
    top = ((unsigned long)&__heap_base + 15) & ~15ul;
    matrices = take(count * bytes), gram = take(bytes), polynomial = take(bytes), next = take(bytes);
    return matrices;
}

// to = share * base + factor * a b, in 4 rows from o, and in 1 or 2 vectors of columns from p. The element of a in row i
// and column k is a[i * row + k * column].
INLINE void block(
    float *to, float share, const float *base, float factor, const float *a, int row, int column, const float *b, int o,
    int p, int vectors
) {
    Floats sums[4][2];
    for (int i = 0; i < 4; ++i) sums[i][0] = sums[i][1] = all(0);
    a += o * row, b += p;
    for (int k = 0; k < size; ++k, a += column, b += size)
        for (int i = 0; i < 4; ++i)
            for (int v = 0; v < vectors; ++v) sums[i][v] += all(a[i * row]) * ((const Floats *)b)[v];
    for (int i = 0; i < 4; ++i)
        for (int v = 0; v < vectors; ++v) {
            int at = (o + i) * size + p + 4 * v;
            *(Floats *)(to + at) = all(share) * *(const Floats *)(base + at) + all(factor) * sums[i][v];
        }
}

// to = share * base + factor * a b, or a^T b. is_symmetric: the result is symmetric; half of it is computed.
static void combine(
    float *to, float share, const float *base, float factor, const float *a, int is_transposed, const float *b,
    int is_symmetric
) {
    int row = is_transposed ? 1 : size, column = is_transposed ? size : 1;
    for (int o = 0; o < size; o += 4) {
        int p = is_symmetric ? o & ~7 : 0;
        for (; p + 8 <= size; p += 8) block(to, share, base, factor, a, row, column, b, o, p, 2);
        if (p < size) block(to, share, base, factor, a, row, column, b, o, p, 1);
    }
    for (int o = 0; is_symmetric && o < size; ++o)
        for (int p = 0; p < o; ++p) to[o * size + p] = to[p * size + o];
}

// Moves each prepared matrix near to the orthogonal factor of its polar decomposition, by the Newton-Schulz iteration of
// Muon (Jordan et al. 2024): X = a X + X (b X^T X + c (X^T X)^2), which brings the singular values near 1.
EXPORT void orthogonalize(int iterations) {
    int entries = size * size;
    for (int m = 0; m < matrix_count; ++m) {
        float *own = matrices + m * entries, *x = own, *to = next, squares = 0;
        for (int i = 0; i < entries; ++i) squares += x[i] * x[i];
        float factor = 1 / (__builtin_sqrtf(squares) + 1e-20f);
        for (int i = 0; i < entries; ++i) x[i] *= factor;
        for (int i = 0; i < iterations; ++i) {
            combine(gram, 0, x, 1, x, 1, x, 1);
            combine(polynomial, -4.775f, gram, 2.0315f, gram, 1, gram, 1);
            combine(to, 3.4445f, x, 1, x, 0, polynomial, 0);
            float *swap = x; x = to; to = swap;
        }
        if (x != own) __builtin_memcpy(own, x, 4 * entries);
    }
}

// Clang may turn loops into calls of these.
void *memset(void *to, int value, unsigned long n) {
    for (char *c = to; n--;) *c++ = (char)value;
    return to;
}
void *memcpy(void *to, const void *from, unsigned long n) {
    char *c = to;
    for (const char *d = from; n--;) *c++ = *d++;
    return to;
}
