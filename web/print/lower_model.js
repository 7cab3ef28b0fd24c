// Lowers a model to functions of a few ops on vectors packed in vec4, as ir/lower.py.
//
// lowered(model) returns {constants, values, gradients, texture}. constants: a Map from names to {rows, columns,
// values}; values: a Float32Array in row order, zero-padded to multiples of 4; a vector has 0 columns. values,
// gradients: one function per level. texture: a function, or null. A function is {name, ops, outputs, blocks}; `blocks`
// maps each value to its number of vec4.
//
// affine: result = matrix source + bias. transposed: result = transpose(matrix) source. sine, cosine: result = sin or
// cos(source). product: result = left * right. dot: result = dot(row, source) + offset, a scalar.
export function lowered(model) {
    const moving = model.inputs === "xyzt", constants = new Map(), values = [], gradients = [];
    const define = (name, ops, outputs) => ({name, ops, outputs, blocks: blocksOf(ops, constants)});
    const forward = (key, network, outputs) => {
        store(key, network, moving, constants);
        return evaluation(key, network, outputs, constants);
    };
    model.levels.forEach(({network}, i) => {
        const key = String(i + 1), ops = forward(key, network, ["f"]);
        values.push(define(`network${key}`, ops, ["f"]));
        gradients.push(define(`network${key}_gradient`, [...ops, ...adjoint(key, network)], ["gradient", "f"]));
    });
    const color = ["r", "g", "b"];
    const texture = model.texture && define("network_texture", forward("t", model.texture, color), color);
    return {constants, values, gradients, texture};
}

export const isProduct = (op) => op.kind === "affine" || op.kind === "transposed";

// Returns the largest side of a function's matrices.
export function widest({ops, blocks}) {
    const sides = ops.filter(isProduct).flatMap(({source, result}) => [blocks.get(source), blocks.get(result)]);
    return 4 * Math.max(...sides);
}

const padded = (size) => (size + 3) & ~3;

function vector(values) {
    const result = new Float32Array(padded(values.length));
    result.set(values);
    return {rows: result.length, columns: 0, values: result};
}

// Adds a network's weights to the constants. Unless the field moves, the first bias becomes the matrix column for the
// input's 1.
function store(key, network, moving, constants) {
    network.slice(0, -1).forEach(({rows, columns, weight, bias}, j) => {
        const folded = j === 0 && !moving;
        const matrix = {rows: padded(rows), columns: padded(columns + (folded ? 1 : 0))};
        matrix.values = new Float32Array(matrix.rows * matrix.columns);
        for (let o = 0; o < rows; ++o) {
            matrix.values.set(weight.subarray(o * columns, (o + 1) * columns), o * matrix.columns);
            if (folded) matrix.values[o * matrix.columns + columns] = bias[o];
        }
        constants.set(`w${key}_${j}`, matrix);
        if (!folded) constants.set(`b${key}_${j}`, vector(bias));
    });
    const {rows, columns, weight} = network.at(-1);
    for (let c = 0; c < rows; ++c)
        constants.set(`o${key}_${c}`, vector(weight.subarray(c * columns, (c + 1) * columns)));
}

// Returns the ops of a network: a sine after every layer but the last (Eq. 2).
function evaluation(key, network, outputs, constants) {
    const ops = [], known = (name) => (constants.has(name) ? name : null), {bias} = network.at(-1);
    let source = "p";
    for (let j = 0; j < network.length - 1; ++j) {
        ops.push({kind: "affine", result: `a${j}`, source, matrix: `w${key}_${j}`, bias: known(`b${key}_${j}`)});
        ops.push({kind: "sine", result: `h${j}`, source: `a${j}`});
        source = `h${j}`;
    }
    outputs.forEach((result, c) => ops.push({kind: "dot", result, source, row: `o${key}_${c}`, offset: bias[c]}));
    return ops;
}

// Returns the further ops of the gradient: g = (g * cos a_j) W_j, from the output back.
function adjoint(key, network) {
    const ops = [];
    let left = `o${key}_0`;
    for (let j = network.length - 2; j >= 0; --j) {
        const result = j ? `e${j}` : "gradient";
        ops.push({kind: "cosine", result: `c${j}`, source: `a${j}`});
        ops.push({kind: "product", result: `g${j}`, left, right: `c${j}`});
        ops.push({kind: "transposed", result, source: `g${j}`, matrix: `w${key}_${j}`});
        left = result;
    }
    return ops;
}

function blocksOf(ops, constants) {
    const blocks = new Map([["p", 1]]);
    for (const {kind, result, source, right, matrix} of ops) {
        const {rows, columns} = constants.get(matrix) ?? {};
        blocks.set(result, {affine: rows / 4, transposed: columns / 4, dot: 1}[kind] ?? blocks.get(source ?? right));
    }
    return blocks;
}
