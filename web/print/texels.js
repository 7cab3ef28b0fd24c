import {shared} from "../model/facts.js";
import {constantsOf, elementwise, number} from "./cstyle.js";
import {isProduct} from "./lower_model.js";

// Prints weights in a texture of four floats per texel, read in loops, as codegen/printers/texels.py.
export const TEXTURE_WIDTH = shared.texture_width;

const COLUMN = `(k) & ${TEXTURE_WIDTH - 1}`, ROW = `(k) >> ${Math.log2(TEXTURE_WIDTH)}`;

// Functions that read one texel and one 4 x 4 block.
export const READERS = [
    `vec4 texel(int k) { return texelFetch(weights, ivec2(${COLUMN}, ${ROW}), 0); }`,
    "mat4 block(int k) { return mat4(texel(k), texel(k + 1), texel(k + 2), texel(k + 3)); }",
];

/** Lays out the constants of functions in one texture: consecutive texels from an offset; a block of a matrix is four
 * texels, its columns. height: rows of TEXTURE_WIDTH texels.
 * @param {Code[]} functions @param {Table<Constant>} constants */
export function layOut(functions, constants) {
    const offsets = /** @type {Table<number>} */ (new Map()), texels = [];
    for (const name of constantsOf(functions)) {
        const {rows, columns, values} = constants.get(name);
        offsets.set(name, texels.length / 4);
        if (!columns) texels.push(...values);
        for (let o = 0; columns && o < rows; o += 4)
            for (let i = 0; i < columns; ++i)
                for (let k = 0; k < 4; ++k) texels.push(values[(o + k) * columns + i]);
    }
    const height = Math.ceil(texels.length / 4 / TEXTURE_WIDTH);
    const image = new Float32Array(4 * TEXTURE_WIDTH * height);
    image.set(texels);
    return {offsets, texels: image, height};
}

/** Returns a function's statements: one loop for each run of ops over the same blocks. A value that no later run
 * reads is a vec4 inside the loop. most: largest number of 4 x 4 products per iteration.
 * @param {Code} code @param {Table<number>} offsets @param {number} most */
export function looped({ops, blocks, outputs}, offsets, most) {
    /** @type {string[]} */ const lines = [], runs = fused(ops, blocks);
    runs.forEach((run, i) => {
        const later = new Set([...outputs, ...runs.slice(i + 1).flat().flatMap(sources)]);
        const isInner = (/** @type {Op} */ op) => op.kind !== "dot" && !later.has(op.result);
        const inner = new Set(run.filter(isInner).map(({result}) => result));
        const at = (value = "", k = "k") =>
            offsets.has(value) ?
                `texel(${offsets.get(value)} + ${k})`
                : blocks.get(value) === 1 || inner.has(value)
                ? value
                : `${value}[${k}]`;
        const before = [], body = [], after = [];
        for (const op of run) {
            if (op.kind === "dot") {
                before.push(`float ${op.result} = 0.;`);
                body.push(`${op.result} += dot(${at(op.row)}, ${at(op.source)});`);
                after.push(`${op.result} = 1. * ${op.result} + ${number(op.offset)};`);
                continue;
            }
            const n = blocks.get(op.result), type = inner.has(op.result) ? "vec4 " : "";
            if (!type) before.push(`vec4 ${op.result}${n === 1 ? "" : `[${n}]`};`);
            if (isProduct(op)) body.push(...product(op, n, blocks.get(op.source), offsets.get(op.matrix), at, most));
            body.push(`${type}${at(op.result)} = ${isProduct(op) ? "s" : elementwise(op, at)};`);
        }
        lines.push(...before, ...loop("k", span(run[0], blocks), body), ...after);
    });
    return lines;
}

/** Returns the loop iterations of one call. llvmpipe also counts the test that ends a loop.
 * @param {Code} code @param {number} most */
export function countLoops({ops, blocks}, most) {
    let total = 0;
    for (const group of fused(ops, blocks)) {
        const sources = group.filter(isProduct).map(({source}) => blocks.get(source)).filter((m) => m > 1);
        const inner = sources.reduce((sum, m) => sum + m / unroll(m, most) + 1, 0);
        total += span(group[0], blocks) * (1 + inner) + 1;
    }
    return total;
}

/** Returns the lines that compute s, block k of n, of a product of the matrix at texel `base` and a source of m
 * blocks.
 * @param {Op} op @param {number} n @param {number} m @param {number} base
 * @param {(value: string | undefined, k?: string) => string} at @param {number} most */
function product(op, n, m, base, at, most) {
    const term = (/** @type {string} */ j) =>
        op.kind === "transposed"
            ? `s += ${at(op.source, j)} * block(${base} + 4 * k + ${4 * n} * (${j}));`
            : `s += block(${base} + ${4 * m} * k + 4 * (${j})) * ${at(op.source, j)};`;
    const step = unroll(m, most), terms = Array.from({length: step}, (_, u) => term(u ? `j + ${u}` : "j"));
    return [`vec4 s = ${op.bias ? at(op.bias) : "vec4(0)"};`, ...(m === 1 ? [term("0")] : loop("j", m, terms, step))];
}

/** Returns the names of an op's operands, without matrix, bias and row. @param {Op} op */
const sources = ({source, left, right}) => [source, left, right].filter(Boolean);
/** @param {Op} op @param {Table<number>} blocks */
const span = (op, blocks) => blocks.get(op.kind === "dot" ? op.source : op.result);

/** Returns runs of ops over equally many blocks, in which no op needs a whole vector of its own run.
 * @param {Op[]} ops @param {Table<number>} blocks */
function fused(ops, blocks) {
    /** @type {Op[][]} */ const groups = [];
    for (const op of ops) {
        if (isProduct(op) || !groups.length || span(op, blocks) !== span(groups.at(-1)[0], blocks)) groups.push([]);
        groups.at(-1).push(op);
    }
    return groups;
}

/** Returns the products per iteration: the largest proper divisor up to `most`.
 * @param {number} count @param {number} most */
function unroll(count, most) {
    for (let u = Math.min(most, count - 1); u > 1; --u) if (count % u === 0) return u;
    return 1;
}

/** @param {string} variable @param {number} count @param {string[]} body */
function loop(variable, count, body, step = 1) {
    const advance = step === 1 ? `++${variable}` : `${variable} += ${step}`;
    const head = `for (int ${variable} = 0; ${variable} < ${count}; ${advance}) {`;
    return [head, ...body.map((line) => `    ${line}`), "}"];
}
