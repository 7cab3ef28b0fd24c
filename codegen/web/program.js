// The field's GLSL of any model: what codegen/field.py, lower.py, texture.py and literal.py print, to the byte
// (tests/test_page_models.py compares them).
// printField(model, storage) -> {text, texels, height, loops}: the text of field(), field_gradient() and albedo(); its
// weight texture, 1024 texels of four floats wide, height 0 where there is none; and the loop iterations that a call
// costs, at each level, as llvmpipe counts them.
// storage: "texture", "literal", or "auto": literals up to 64 wide, the texture above.
export const TEXTURE_WIDTH = 1024;
const UNROLL = 32, WIDEST_LITERAL = 64;

export function printField(model, storage) {
    const moving = model.inputs === "xyzt", constants = new Map();
    const values = [], gradients = [];
    model.levels.forEach(({network}, i) => {
        const lowered = lower(String(i + 1), network, moving, constants, ["f"]);
        values.push({name: `network${i + 1}`, ops: lowered.forward, outputs: ["f"]});
        gradients.push({name: `network${i + 1}_gradient`, ops: lowered.gradient, outputs: ["gradient", "f"]});
    });
    const functions = [...values, ...gradients];
    if (model.texture) {
        const names = ["r", "g", "b"];
        const ops = lower("t", model.texture, moving, constants, names).forward;
        functions.push({name: "network_texture", ops, outputs: names});
    }
    const isLiteral = ({ops}) => storage === "literal" || storage === "auto" && widest(ops, constants) <= WIDEST_LITERAL;
    const layout = layOut(functions.filter((each) => !isLiteral(each)), constants);
    const lines = declareLiterals(functions.filter(isLiteral), constants);
    if (!functions.every(isLiteral)) {
        lines.push("vec4 texel(int k) { return texelFetch(weights, ivec2((k) & 1023, (k) >> 10), 0); }",
            "mat4 block(int k) { return mat4(texel(k), texel(k + 1), texel(k + 2), texel(k + 3)); }");
    }
    for (const each of functions) {
        const blocks = blocksOf(each.ops, constants);
        const body = isLiteral(each) ? straight(each.ops, blocks) : looped(each.ops, blocks, layout.offsets);
        lines.push("", ...printFunction(each, body));
    }
    lines.push("", ...printCalls(model, values, gradients, moving));
    const upTo = (list) => {
        let total = 0;
        return list.map((each) => (total += isLiteral(each) ? 0 : countLoops(each.ops, constants)));
    };
    const loops = {value: upTo(values), gradient: upTo(gradients), texture: model.texture ? upTo(functions.slice(-1))[0] : 0};
    return {text: lines.join("\n") + "\n", texels: layout.texels, height: layout.height, loops};
}

const padded = (size) => (size + 3) & ~3;

// A network's constants, padded to multiples of 4, and the ops of its value and of its adjoint.
function lower(key, network, moving, constants, names) {
    const last = network.length - 2;
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
    const {columns, weight, bias} = network.at(-1);
    const forward = [];
    let source = "p";
    for (let j = 0; j <= last; ++j) {
        const name = `b${key}_${j}`;
        forward.push({kind: "affine", result: `a${j}`, source, matrix: `w${key}_${j}`, bias: constants.has(name) ? name : null});
        forward.push({kind: "sine", result: `h${j}`, source: `a${j}`});
        source = `h${j}`;
    }
    names.forEach((name, c) => {
        const row = `o${key}_${c}`;
        constants.set(row, vector(weight.subarray(c * columns, (c + 1) * columns)));
        forward.push({kind: "dot", result: name, source, row, bias: bias[c]});
    });
    const gradient = [...forward];
    let adjoint = `o${key}_0`;
    for (let j = last; j >= 0; --j) {
        gradient.push({kind: "cosine", result: `c${j}`, source: `a${j}`});
        gradient.push({kind: "product", result: `g${j}`, left: adjoint, right: `c${j}`});
        adjoint = j ? `e${j}` : "gradient";
        gradient.push({kind: "transposed", result: adjoint, source: `g${j}`, matrix: `w${key}_${j}`});
    }
    return {forward, gradient};
}

function vector(values) {
    const result = new Float32Array(padded(values.length));
    result.set(values);
    return {rows: result.length, columns: 0, values: result};
}

// The constants that functions use, each once, in order of first use.
function namesIn(functions, constants) {
    const names = functions.flatMap(({ops}) => ops.flatMap((op) => [op.matrix, op.bias, op.row]));
    return new Set(names.filter((name) => constants.has(name)));
}

// A constant is a run of texels; a matrix block is four of them, its columns.
function layOut(functions, constants) {
    const offsets = new Map(), texels = [];
    for (const name of namesIn(functions, constants)) {
        offsets.set(name, texels.length / 4);
        const {rows, columns, values} = constants.get(name);
        if (!columns) texels.push(...values);
        for (let o = 0; o < (columns ? rows : 0); o += 4)
            for (let i = 0; i < columns; ++i)
                for (let k = 0; k < 4; ++k) texels.push(values[(o + k) * columns + i]);
    }
    const height = Math.ceil(texels.length / 4 / TEXTURE_WIDTH);
    const image = new Float32Array(4 * TEXTURE_WIDTH * height);
    image.set(texels);
    return {offsets, texels: image, height};
}

// Value name -> number of vec4 in it.
function blocksOf(ops, constants) {
    const blocks = new Map([["p", 1]]);
    for (const op of ops) {
        const count = {
            affine: () => constants.get(op.matrix).rows / 4, transposed: () => constants.get(op.matrix).columns / 4,
            dot: () => 1, product: () => blocks.get(op.right),
        }[op.kind] ?? (() => blocks.get(op.source));
        blocks.set(op.result, count());
    }
    return blocks;
}

const isProduct = (op) => op.kind === "affine" || op.kind === "transposed";
const lengthOf = (op, blocks) => blocks.get(op.kind === "dot" ? op.source : op.result);

// Runs of ops over equally many blocks, none of which needs a whole vector that its own run makes.
function fused(ops, blocks) {
    const groups = [];
    for (const op of ops) {
        if (isProduct(op) || !groups.length || lengthOf(op, blocks) !== lengthOf(groups.at(-1)[0], blocks)) groups.push([]);
        groups.at(-1).push(op);
    }
    return groups;
}

function unroll(count) {
    for (let u = Math.min(UNROLL, count - 1); u > 1; --u) if (count % u === 0) return u;
    return 1;
}

function loop(variable, count, body, step = 1) {
    const advance = step === 1 ? `++${variable}` : `${variable} += ${step}`;
    return [`for (int ${variable} = 0; ${variable} < ${count}; ${advance}) {`, ...body.map((line) => `    ${line}`), "}"];
}

function widest(ops, constants) {
    return Math.max(...ops.filter(isProduct).map(({matrix}) => Math.max(constants.get(matrix).rows, constants.get(matrix).columns)));
}

// The right-hand side of an elementwise op, its operands printed by `at`.
function elementwise(op, at) {
    return op.kind === "product" ? `${at(op.left)} * ${at(op.right)}` : `${op.kind}(${at(op.source)})`;
}

// One constant for each vec4 or 4 x 4 block, in order of first use.
function declareLiterals(functions, constants) {
    const lines = new Map(), literals = (values) => Array.from(values, number).join(", ");
    for (const name of namesIn(functions, constants)) {
        const {rows, columns, values} = constants.get(name), list = [];
        for (let o = 0; o < rows; o += 4) {
            if (!columns) list.push(`const vec4 ${name}_${o / 4} = vec4(${literals(values.subarray(o, o + 4))});`);
            for (let i = 0; i < columns; i += 4) {
                const block = Array.from({length: 16}, (_, k) => values[(o + k % 4) * columns + i + (k >> 2)]);
                list.push(`const mat4 ${name}_${o / 4}_${i / 4} = mat4(${literals(block)});`);
            }
        }
        lines.set(name, list);
    }
    return [...lines.values()].flat();
}

// A function's statements with its weights as constants: no loops, one `+=` for each term.
function straight(ops, blocks) {
    const lines = [], at = (value, k) => (blocks.get(value) === 1 ? value : `${value}_${k}`);
    const count = (length, print) => Array.from({length}, (_, k) => print(k));
    for (const op of ops) {
        const m = blocks.get(op.source);
        for (let k = 0; k < blocks.get(op.result); ++k) {
            const name = at(op.result, k);
            const terms = {
                affine: () => [...(op.bias ? [`${op.bias}_${k}`] : []),
                    ...count(m, (i) => `${op.matrix}_${k}_${i} * ${at(op.source, i)}`)],
                transposed: () => count(m, (o) => `${at(op.source, o)} * ${op.matrix}_${o}_${k}`),
                dot: () => [number(op.bias), ...count(m, (i) => `dot(${op.row}_${i}, ${at(op.source, i)})`)],
            }[op.kind]?.() ?? [elementwise(op, (value) => at(value, k))];
            lines.push(`${op.kind === "dot" ? "float" : "vec4"} ${name} = ${terms[0]};`);
            lines.push(...terms.slice(1).map((term) => `${name} += ${term};`));
        }
    }
    return lines;
}

// A function's statements with its weights in the texture: one loop for each run of ops over the same blocks.
function looped(ops, blocks, offsets) {
    const at = (value, k) => offsets.has(value) ? `texel(${offsets.get(value)} + ${k})`
        : blocks.get(value) === 1 ? value : `${value}[${k}]`;
    const product = (op) => {
        const n = blocks.get(op.result), m = blocks.get(op.source), base = offsets.get(op.matrix);
        const term = (j) => op.kind === "transposed"
            ? `s += ${at(op.source, j)} * block(${base} + 4 * k + ${4 * n} * (${j}));`
            : `s += block(${base} + ${4 * m} * k + 4 * (${j})) * ${at(op.source, j)};`;
        const step = unroll(m);
        const terms = Array.from({length: step}, (_, u) => term(u ? `j + ${u}` : "j"));
        return [`vec4 s = ${op.bias ? at(op.bias, "k") : "vec4(0)"};`,
            ...(m === 1 ? [term("0")] : loop("j", m, terms, step)), `${at(op.result, "k")} = s;`];
    };
    const lines = [];
    for (const group of fused(ops, blocks)) {
        const before = [], body = [], after = [];
        for (const op of group) {
            if (op.kind === "dot") {
                before.push(`float ${op.result} = 0.;`);
                body.push(`${op.result} += dot(${at(op.row, "k")}, ${at(op.source, "k")});`);
                after.push(`${op.result} = 1. * ${op.result} + ${number(op.bias)};`);
                continue;
            }
            const n = blocks.get(op.result);
            before.push(`vec4 ${op.result}${n === 1 ? "" : `[${n}]`};`);
            if (isProduct(op)) body.push(...product(op));
            else body.push(`${at(op.result, "k")} = ${elementwise(op, (value) => at(value, "k"))};`);
        }
        lines.push(...before, ...loop("k", lengthOf(group[0], blocks), body), ...after);
    }
    return lines;
}

function printFunction({name, outputs}, body) {
    const [type, result] = {
        1: ["float", outputs[0]], 2: ["vec4", `vec4(${outputs[0]}.xyz, ${outputs[1]})`], 3: ["vec3", `vec3(${outputs.join(", ")})`],
    }[outputs.length];
    return [`${type} ${name}(vec4 p) {`, ...body.map((line) => `    ${line}`), `    return ${result};`, "}"];
}

function countLoops(ops, constants) {
    const blocks = blocksOf(ops, constants);
    let total = 0;
    for (const group of fused(ops, blocks)) {
        let inner = 1;
        for (const op of group) {
            const m = blocks.get(op.source);
            if (isProduct(op) && m > 1) inner += m / unroll(m) + 1;
        }
        total += lengthOf(group[0], blocks) * inner + 1;
    }
    return total;
}

function printCalls(model, values, gradients, moving) {
    const input = `vec4(p, ${moving ? "time" : "1."})`;
    const lines = ["float field(vec3 p, int level, out int reached) {", `    vec4 q = ${input};`,
        `    float f = ${values[0].name}(q);`, "    reached = 1;"];
    values.slice(1).forEach(({name}, k) => {
        const i = k + 1;
        lines.push(`    if (reached == ${i} && level > ${i} && abs(f) < delta[${i - 1}]) {`,
            `        f += ${name}(q);`, `        reached = ${i + 1};`, "    }");
    });
    lines.push("    return f;", "}", "", "vec4 field_gradient(vec3 p, int level) {", `    vec4 q = ${input};`,
        `    vec4 g = ${gradients[0].name}(q);`);
    gradients.slice(1).forEach(({name}, k) => lines.push(`    if (level > ${k + 1}) g += ${name}(q);`));
    const colour = model.texture ? `clamp(network_texture(${input}), 0., 1.)` : "vec3(0.80, 0.74, 0.66)";
    lines.push("    return g;", "}", "", "vec3 albedo(vec3 p) {", `    return ${colour};`, "}");
    return lines;
}

// Shortest literal that reads back as the same float32.
export function number(value) {
    const x = Math.fround(value);
    let digits = 1;
    while (digits < 9 && Math.fround(Number(x.toPrecision(digits))) !== x) ++digits;
    if (x && Math.abs(x) < 1e-4) return x.toExponential(digits - 1);
    const text = String(Number(x.toPrecision(digits)));
    if (/e/.test(text)) return text.replace("e+", "e");
    return text.includes(".") ? text.replace(/^(-?)0\./, "$1.") : `${text}.`;
}
