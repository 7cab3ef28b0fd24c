// A training step of a SIREN on a GPU: the loss of a batch, and its derivative by the weights; samples, weights and
// passes are those of siren.c. The host puts WIDTH (a multiple of 4), DEPTH (hidden layers after the first) and OUTPUTS
// before this text.
//
// A work group takes tiles of TILE points in turn. Its arrays are [neuron][point], in memory of its own; a matrix is a
// block of one: each column is a neuron, at four points. A thread computes blocks; between layers all threads wait.
// Each group adds up its own gradient; then those of the groups are added up, in a fixed order.
// A level's products take 12 WIDTH^2 DEPTH + 48 WIDTH operations a sample: 0.12 GFLOP a step of 4096 samples of 48x1,
// 0.82 GFLOP of 64x4.
const TILE = 32;
const VECTORS = TILE / 4;
const THREADS = 128;
const LAYERS = DEPTH + 1;
const UNITS = WIDTH / 4; // blocks of four neurons
const BLOCKS = UNITS * VECTORS; // of an array
const LACK = 0.3; // as in siren.c
const SHORTEST = 1e-8;
const ONES = vec4f(1);
const NONE = mat4x4f();

// Numbers of the arrays; one for each layer that follows.
const HIDDEN = 0; // the inputs, then the sines of each layer
const COSINES = LAYERS + 1;
const SLOPES = COSINES + LAYERS; // level: the derivative by the gradient, then df / d hidden, then `bends` of siren.c
const ANGLES = SLOPES + LAYERS + 1; // level: df / d angle; texture: `bends`
const SCRATCH = ANGLES + LAYERS;
const ARRAYS = SCRATCH + 4;

// Offsets in the weights, in vec4s, as is all that follows.
const OUTPUT = 5 * UNITS + DEPTH * (WIDTH + 1) * UNITS;
const OUTPUT_BIASES = OUTPUT + OUTPUTS * UNITS;
const SUMS = OUTPUT_BIASES + 2; // the gradient, then (loss, mean |f| on the surface)

struct Batch {
    value: f32, normal: f32, distance: f32, eikonal: f32, length: f32, excess: f32, lacking: f32, near: f32,
    smoothness: f32, count: u32, share: u32, on: u32, // of each `share` samples, the first `on` lie on the surface
}

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> samples: array<vec4f>; // three vec4s each
@group(0) @binding(2) var<storage, read> weights: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> rows: array<vec4f>; // ARRAYS of each group
@group(0) @binding(4) var<storage, read_write> gradients: array<vec4f>; // SUMS of each group
@group(0) @binding(5) var<storage, read_write> sums: array<vec4f>;

var<workgroup> changes: array<vec4f, 6 * VECTORS>; // derivatives by the outputs; texture: then by their derivatives
var<private> thread: u32;
var<private> tile: u32;
var<private> rows_at: u32;
var<private> gradient_at: u32;
var<private> told: vec4f; // (loss, mean |f|) of a thread's points

fn wait() {
    storageBarrier();
    workgroupBarrier();
}

// --- Blocks

fn load(array_: u32, unit: u32, v: u32) -> mat4x4f {
    let at = rows_at + (array_ * WIDTH + 4 * unit) * VECTORS + v;
    return mat4x4f(rows[at], rows[at + VECTORS], rows[at + 2 * VECTORS], rows[at + 3 * VECTORS]);
}
fn store(array_: u32, unit: u32, v: u32, block: mat4x4f) {
    var columns = block;
    let at = rows_at + (array_ * WIDTH + 4 * unit) * VECTORS + v;
    for (var k = 0u; k < 4; k++) { rows[at + k * VECTORS] = columns[k]; }
}
fn outer(a: vec4f, b: vec4f) -> mat4x4f { return mat4x4f(a * b.x, a * b.y, a * b.z, a * b.w); }
fn times(a: mat4x4f, b: mat4x4f) -> mat4x4f { return mat4x4f(a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]); }

// Offsets of W_j and b_j; vec4s of a row of W_j.
fn matrix(j: u32) -> u32 { return select((5 + (j - 1) * (WIDTH + 1)) * UNITS, 0u, j == 0); }
fn biases(j: u32) -> u32 { return matrix(j) + row_size(j) * WIDTH; }
fn row_size(j: u32) -> u32 { return select(UNITS, 1u, j == 0); }
fn four_rows(at: u32, size: u32) -> mat4x4f {
    return mat4x4f(weights[at], weights[at + size], weights[at + 2 * size], weights[at + 3 * size]);
}

// A block of W_j times an array.
fn multiplied(j: u32, array_: u32, unit: u32, v: u32) -> mat4x4f {
    var total = NONE;
    let size = row_size(j);
    for (var k = 0u; k < size; k++) { total += load(array_, k, v) * four_rows(matrix(j) + 4 * unit * size + k, size); }
    return total;
}
// A block of W_j^T times an array.
fn multiplied_transposed(j: u32, array_: u32, unit: u32, v: u32) -> mat4x4f {
    var total = NONE;
    let size = row_size(j);
    for (var k = 0u; k < UNITS; k++) {
        total += load(array_, k, v) * transpose(four_rows(matrix(j) + 4 * k * size + unit, size));
    }
    return total;
}
// Adds a b^T, summed over the points, to the gradient of W_j.
fn add_products(j: u32, a: u32, b: u32) {
    let size = row_size(j);
    for (var t = thread; t < UNITS * size; t += THREADS) {
        var total = NONE;
        for (var v = 0u; v < VECTORS; v++) { total += transpose(load(b, t % size, v)) * load(a, t / size, v); }
        let at = gradient_at + matrix(j) + t / size * 4 * size + t % size;
        for (var k = 0u; k < 4; k++) { gradients[at + k * size] += total[k]; }
    }
}

// sin(x + quarter pi / 2), as in siren.c: the precision of sin() itself is not enough.
fn wave(x: vec4f, quarter: i32) -> vec4f {
    let turns = round(x * 0.63661977236758134);
    let r = x - turns * 1.5703125 - turns * 4.837512969970703125e-4 - turns * 7.549789948768648e-8;
    let q = r * r;
    let s = ((-1.9515295891e-4 * q + 8.3321608736e-3) * q - 1.6666654611e-1) * (q * r) + r;
    let c = ((2.443315711809948e-5 * q - 1.388731625493765e-3) * q + 4.166664568298827e-2) * (q * q) - 0.5 * q + 1.0;
    let at = vec4i(turns) + quarter;
    let size = select(s, c, (at & vec4i(1)) == vec4i(1));
    return select(size, -size, (at & vec4i(2)) == vec4i(2));
}
fn waves(x: mat4x4f, quarter: i32) -> mat4x4f {
    return mat4x4f(wave(x[0], quarter), wave(x[1], quarter), wave(x[2], quarter), wave(x[3], quarter));
}

// --- Passes over a tile

// Four samples' vec4s of a kind, as a block.
fn inputs(v: u32, kind: u32) -> mat4x4f {
    let at = 3 * (tile * TILE + 4 * v) + kind;
    return transpose(mat4x4f(samples[at], samples[at + 3], samples[at + 6], samples[at + 9]));
}
fn forward() {
    if (thread < VECTORS) { store(HIDDEN, 0, thread, inputs(thread, 0)); }
    for (var j = 0u; j < LAYERS; j++) {
        wait();
        for (var t = thread; t < BLOCKS; t += THREADS) {
            let unit = t / VECTORS;
            let v = t % VECTORS;
            let angle = multiplied(j, HIDDEN + j, unit, v) + outer(ONES, weights[biases(j) + unit]);
            store(HIDDEN + j + 1, unit, v, waves(angle, 0));
            store(COSINES + j, unit, v, waves(angle, 1));
        }
    }
    wait();
}
// One output of an array, without its bias.
fn output_of(c: u32, array_: u32, v: u32) -> vec4f {
    var total = vec4f();
    for (var k = 0u; k < UNITS; k++) { total += load(array_, k, v) * weights[OUTPUT + c * UNITS + k]; }
    return total;
}
// Adds to the gradient of the output layer. along: the array that `second` derivatives multiply; level: of each alone.
fn add_outputs(along: u32) {
    for (var t = thread; t < OUTPUTS * UNITS; t += THREADS) {
        let c = t / UNITS;
        var total = vec4f();
        for (var v = 0u; v < VECTORS; v++) {
            total += changes[c * VECTORS + v] * load(HIDDEN + LAYERS, t % UNITS, v);
            total += changes[(3 + c) * VECTORS + v] * load(along, t % UNITS, v);
        }
        gradients[gradient_at + OUTPUT + t] += total;
    }
    if (thread == 0) {
        for (var k = 0u; k < OUTPUTS * VECTORS; k++) {
            gradients[gradient_at + OUTPUT_BIASES][k / VECTORS] += dot(changes[k], ONES);
        }
    }
}
// From the outputs down, through the values: adds to the gradient of W_j and b_j.
fn down() {
    for (var j = LAYERS; j > 0; j--) {
        let now = SCRATCH + j % 2; // dL / d angle; texture: two arrays on, dL / d of its derivative along the direction
        let before = SCRATCH + (j + 1) % 2;
        for (var t = thread; t < BLOCKS; t += THREADS) {
            let unit = t / VECTORS;
            let v = t % VECTORS;
            var d = NONE;
            var d_along = NONE;
            if (j < LAYERS) {
                d = multiplied_transposed(j, before, unit, v);
                if (OUTPUTS > 1) { d_along = multiplied_transposed(j, before + 2, unit, v); }
            } else {
                for (var c = 0u; c < OUTPUTS; c++) {
                    d += outer(changes[c * VECTORS + v], weights[OUTPUT + c * UNITS + unit]);
                    d_along += outer(changes[(3 + c) * VECTORS + v], weights[OUTPUT + c * UNITS + unit]);
                }
            }
            let cosine = load(COSINES + j - 1, unit, v);
            var bend = load(SLOPES + j, unit, v);
            if (OUTPUTS > 1) {
                bend = times(d_along, load(ANGLES + j - 1, unit, v));
                store(now + 2, unit, v, times(d_along, cosine));
            }
            store(now, unit, v, times(d, cosine) - times(bend, load(HIDDEN + j, unit, v)));
        }
        wait();
        add_products(j - 1, now, HIDDEN + j - 1);
        if (OUTPUTS > 1) { add_products(j - 1, now + 2, SLOPES + j - 1); }
        for (var unit = thread; unit < UNITS; unit += THREADS) {
            var total = vec4f();
            for (var v = 0u; v < VECTORS; v++) { total += ONES * load(now, unit, v); }
            gradients[gradient_at + biases(j - 1) + unit] += total;
        }
    }
    wait();
}

// --- Losses

// Returns the derivatives of the loss of Eq. 4 by the gradient g of the field, then by its value f, at the i-th sample.
fn level_loss(i: u32, slope: vec3f, value: f32) -> vec4f {
    let of_before = samples[3 * i + 1];
    let rest = samples[3 * i + 2];
    let f = value + of_before.x;
    let g = slope + of_before.yzw;
    let is_known = (bitcast<u32>(rest.x) & 0x7fffffffu) <= 0x7f800000u; // a NaN is unknown
    let truth = select(f, rest.x, is_known);
    let all = f32(batch.count);
    let surface = all / f32(batch.share) * f32(batch.on);
    let size = max(sqrt(dot(g, g)), SHORTEST);
    let stretch = size - 1.0;
    let error = f - truth;
    told.x += batch.eikonal * stretch * stretch / all;
    let eikonal = batch.eikonal * 2.0 / all * stretch / size * g;
    if (i % batch.share < batch.on) {
        let cosine = dot(g, rest.yzw) / size;
        told += vec4f(batch.value * error * error + batch.normal * (1.0 - cosine), abs(error), 0.0, 0.0) / surface;
        let turn = batch.normal / (surface * size) * (g / size * cosine - rest.yzw);
        return vec4f(batch.length * eikonal + turn, batch.value * 2.0 / surface * error);
    }
    var factor = select(1.0, batch.excess, abs(f) > abs(truth) && abs(truth) > batch.near);
    if (batch.lacking != 1.0 && f * sign(truth) < LACK * abs(truth)) { factor = batch.lacking; }
    factor *= batch.distance / (all - surface);
    if (rest.y == 0.0) { told.x += factor * error * error; } // else a hard sample
    return vec4f(eikonal, 2.0 * factor * error);
}
fn level_tile() {
    forward();
    // The gradient, from the output down.
    for (var j = LAYERS; j > 0; j--) {
        for (var t = thread; t < BLOCKS; t += THREADS) {
            let unit = t / VECTORS;
            let v = t % VECTORS;
            var slope = outer(ONES, weights[OUTPUT + unit]);
            if (j < LAYERS) { slope = multiplied_transposed(j, ANGLES + j, unit, v); }
            store(SLOPES + j, unit, v, slope);
            store(ANGLES + j - 1, unit, v, times(slope, load(COSINES + j - 1, unit, v)));
        }
        wait();
    }
    if (thread < VECTORS) {
        var slopes = transpose(multiplied_transposed(0, ANGLES, 0, thread)); // of each point
        var f = output_of(0, HIDDEN + LAYERS, thread) + weights[OUTPUT_BIASES].x;
        for (var p = 0u; p < 4; p++) {
            let d = level_loss(tile * TILE + 4 * thread + p, slopes[p].xyz, f[p]);
            slopes[p] = vec4f(d.xyz, 0.0);
            f[p] = d.w;
        }
        store(SLOPES, 0, thread, transpose(slopes));
        changes[thread] = f;
        changes[3 * VECTORS + thread] = ONES;
    }
    wait();
    // Up, through the pass above.
    var from_ = SLOPES;
    for (var j = 0u; j < LAYERS; j++) {
        let to = SCRATCH + 2 + j % 2;
        add_products(j, ANGLES + j, from_);
        for (var t = thread; t < BLOCKS; t += THREADS) {
            let unit = t / VECTORS;
            let v = t % VECTORS;
            let d = multiplied(j, from_, unit, v);
            store(SLOPES + j + 1, unit, v, times(d, load(SLOPES + j + 1, unit, v)));
            store(to, unit, v, times(d, load(COSINES + j, unit, v)));
        }
        from_ = to;
        wait();
    }
    add_outputs(from_);
    down();
}

// The loss of `texture_step`, and its derivatives, in siren.c.
fn texture_tile() {
    if (thread < VECTORS) { store(SLOPES, 0, thread, inputs(thread, 1)); }
    forward();
    // The derivatives along the samples' directions.
    for (var j = 0u; j < LAYERS; j++) {
        for (var t = thread; t < BLOCKS; t += THREADS) {
            let unit = t / VECTORS;
            let v = t % VECTORS;
            let bend = multiplied(j, SLOPES + j, unit, v);
            store(ANGLES + j, unit, v, bend);
            store(SLOPES + j + 1, unit, v, times(bend, load(COSINES + j, unit, v)));
        }
        wait();
    }
    if (thread < OUTPUTS * VECTORS) {
        let c = thread / VECTORS;
        let v = thread % VECTORS;
        let all = f32(batch.count);
        let surface = all / f32(batch.share) * f32(batch.on);
        var truth = inputs(v, 2);
        var error = output_of(c, HIDDEN + LAYERS, v) + weights[OUTPUT_BIASES][c] - truth[c];
        if ((tile * TILE) % batch.share >= batch.on) { error = vec4f(); } // tiles lie on the surface, or off it
        let change = output_of(c, SLOPES + LAYERS, v);
        told.x += dot(error, error) / surface + batch.smoothness * dot(change, change) / all;
        changes[thread] = 2.0 / surface * error;
        changes[3 * VECTORS + thread] = batch.smoothness * 2.0 / all * change;
    }
    wait();
    add_outputs(SLOPES + LAYERS);
    down();
}

// --- The kernel

// Takes a step; dispatched with two rows of groups, it adds up what the groups have left in `gradients`.
@compute @workgroup_size(THREADS)
fn step(
    @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) index: u32,
) {
    thread = index;
    if (groups.y > 1) {
        let at = (2 * group.x + group.y) * THREADS + thread;
        if (at < SUMS) {
            var total = vec4f();
            for (var k = at; k < arrayLength(&gradients); k += SUMS) { total += gradients[k]; }
            sums[at] = total;
        }
        return;
    }
    rows_at = group.x * ARRAYS * WIDTH * VECTORS;
    gradient_at = group.x * SUMS;
    for (var k = thread; k < SUMS; k += THREADS) { gradients[gradient_at + k] = vec4f(); }
    wait();
    for (var k = group.x; k < batch.count / TILE; k += groups.x) {
        tile = k;
        if (OUTPUTS > 1) { texture_tile(); } else { level_tile(); }
    }
    if (thread < 6 * VECTORS) { changes[thread] = told; }
    wait();
    if (thread == 0) {
        for (var k = 0u; k < 6 * VECTORS; k++) { gradients[gradient_at + SUMS - 1] += changes[k]; }
    }
}
