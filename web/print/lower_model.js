/** Lowers a model to functions of a few ops on vectors packed in vec4, as ir/lower.py.
 * @param {Model} model @returns {Lowered} */
export function lowered(model) {
    const moving = model.inputs === "xyzt", constants = /** @type {Table<Constant>} */ (new Map());
    const values = /** @type {Code[]} */ ([]), gradients = /** @type {Code[]} */ ([]);
    /** @type {(name: string, ops: Op[], outputs: string[]) => Code} */
    const define = (name, ops, outputs) => ({name, ops, outputs, blocks: blocksOf(ops, constants)});
    /** @param {string} key @param {Network} network @param {string[]} outputs */
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

/** @param {Op} op @returns {op is Extract<Op, {matrix: string}>} */
export const isProduct = (op) => op.kind === "affine" || op.kind === "transposed";

/** Returns the largest side of a function's matrices. @param {Code} code */
export function widest({ops, blocks}) {
    const sides = ops.filter(isProduct).flatMap(({source, result}) => [blocks.get(source), blocks.get(result)]);
    return 4 * Math.max(...sides);
}

const padded = (/** @type {number} */ size) => (size + 3) & ~3;

/** @param {Float32Array} values */
function vector(values) {
    const result = new Float32Array(padded(values.length));
    result.set(values);
    return {rows: result.length, columns: 0, values: result};
}

/** Adds a network's weights to the constants. Unless the field moves, the first bias becomes the matrix column for
 * the input's 1.
 * @param {string} key @param {Network} network @param {boolean} moving @param {Table<Constant>} constants */
function store(key, network, moving, constants) {
    network.slice(0, -1).forEach(({rows, columns, weight, bias}, j) => {
        const folded = j === 0 && !moving;
        const matrix = /** @type {Constant} */ ({rows: padded(rows), columns: padded(columns + (folded ? 1 : 0))});
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

/** Returns the ops of a network: a sine after every layer but the last (Eq. 2).
 * @param {string} key @param {Network} network @param {string[]} outputs @param {Table<Constant>} constants */
function evaluation(key, network, outputs, constants) {
    /** @type {Op[]} */ const ops = [], {bias} = network.at(-1);
    const known = (/** @type {string} */ name) => (constants.has(name) ? name : null);
    let source = "p";
    for (let j = 0; j < network.length - 1; ++j) {
        ops.push({kind: "affine", result: `a${j}`, source, matrix: `w${key}_${j}`, bias: known(`b${key}_${j}`)});
        ops.push({kind: "sine", result: `h${j}`, source: `a${j}`});
        source = `h${j}`;
    }
    outputs.forEach((result, c) => ops.push({kind: "dot", result, source, row: `o${key}_${c}`, offset: bias[c]}));
    return ops;
}

/** Returns the further ops of the gradient: g = (g * cos a_j) W_j, from the output back.
 * @param {string} key @param {Network} network */
function adjoint(key, network) {
    /** @type {Op[]} */ const ops = [];
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

/** @param {Op[]} ops @param {Table<Constant>} constants */
function blocksOf(ops, constants) {
    const blocks = /** @type {Table<number>} */ (new Map([["p", 1]]));
    for (const {kind, result, source, right, matrix} of ops) {
        const {rows, columns} = constants.get(matrix) ?? {};
        const count = /** @type {Record<string, number>} */ ({affine: rows / 4, transposed: columns / 4, dot: 1})[kind];
        blocks.set(result, count ?? blocks.get(source ?? right));
    }
    return blocks;
}
