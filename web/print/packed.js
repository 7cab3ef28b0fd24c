import {stepOf} from "../model/quantize.js";
import {number} from "./cstyle.js";
import {printFunction} from "./field.js";

// Prints quantized weights, several in each integer, byte for byte as codegen/printers/packed.py, which explains them.
const LARGEST_MULTIPLE = 8191, LIMIT = 2 ** 31;
const MACROS = `#define D(v,k)vec4(v/(k)%ivec4(B)-B/2)
#define L(b,s){const int B=b;const float S=s;
#define M(v)mat4(D(v,1),D(v,B),D(v,B*B),D(v,B*B*B))
#define N(v,w)mat4(D(v,1),D(v,B),D(w,1),D(w,B))
#define E(i,a,b,c,d)dot(D(ivec4(a,b,c,d),1),x[i])+dot(D(ivec4(a,b,c,d),B),x[i+1])`;

/** Returns the lines of the macros and of functions that compute values. constants: of lowered() (lower_model.js).
 * @param {Code[]} functions @param {Table<Constant>} constants */
export function packedLines(functions, constants) {
    const macros = new Map(); // from a layer's shape to its macro
    const layer = (/** @type {Op} */ op) => (op.source === "p" ? firstLayer : hiddenLayer)(op, constants);
    const bodies = functions.map((code) => {
        const outputs = code.ops.filter((op) => op.kind === "dot");
        const rows = outputs.map((op) => multiplesOf(constants.get(op.row).values));
        const base = 2 * Math.max(...rows.map(({most}) => most)) + 1;
        return printFunction(code, [
            `vec4[${Math.max(...code.blocks.values())}] x,y;`,
            ...code.ops.filter(({kind}) => kind === "affine").flatMap((op) => printLayer(layer(op), macros)),
            `const int B=${base};`,
            ...outputs.map((op, k) => printOutput(op, rows[k], base)),
        ]);
    });
    return [...MACROS.split("\n"), ...Array.from(macros.values(), ({text}) => text), ...bodies.flat()];
}

/** Returns values as multiples of their step, the largest multiple, and the step. @param {Float32Array} values */
function multiplesOf(values) {
    const step = /** @type {number} */ (stepOf(values, LARGEST_MULTIPLE)),
        wholes = Array.from(values, (value) => Math.round(value / step));
    return {wholes, most: Math.max(1, ...wholes.map(Math.abs)), step};
}

/** A layer's multiples in row order; its biases as multiples, none in the first layer, whose bias is a column; the base
 * of the digits; the factors of the first layer's input.
 * @typedef {{wholes: number[], columns: number, biases: number[], base: number, step: number, factors: number[]}} Packed */

/** @param {Op} op @param {Table<Constant>} constants @returns {Packed} */
function firstLayer({matrix}, constants) {
    const {values} = constants.get(matrix);
    const weights = multiplesOf(values.filter((_, i) => i % 4 < 3));
    const phases = multiplesOf(values.filter((_, i) => i % 4 === 3));
    const wholeAt = (
        /** @type {number} */ i,
    ) => (i % 4 < 3 ? weights.wholes[3 * (i >> 2) + i % 4] : phases.wholes[i >> 2]);
    const wholes = Array.from(values, (_, i) => wholeAt(i));
    const base = 2 * Math.max(weights.most, phases.most) + 1, {step} = weights;
    return {wholes, columns: 4, biases: [], base, step: 1, factors: [step, step, step, phases.step]};
}

/** @param {Op} op @param {Table<Constant>} constants @returns {Packed} */
function hiddenLayer({matrix, bias}, constants) {
    const {columns, values} = constants.get(matrix), {wholes, most, step} = multiplesOf(values);
    const biases = Array.from(constants.get(bias).values, (value) => Math.round(value / step));
    return {wholes, columns, biases, base: 2 * most + 1, step, factors: []};
}

/** @param {Packed} layer @param {Map<string, {name: string, text: string}>} macros */
function printLayer({wholes, columns, biases, base, step, factors}, macros) {
    const digits = base ** 4 <= LIMIT ? 4 : 2, isBiased = biases.length > 0, key = `${[columns, digits, isBiased]}`;
    const {name} = macros.get(key) ?? {name: `R${macros.size}`};
    macros.set(key, {name, text: rowMacro(name, columns, digits, isBiased)});
    const lines = factors.length ? [`x[0]=p*vec4(${factors.map(number)});`] : [];
    lines.push(`L(${base},${number(step)})`);
    for (let o = 0; o < wholes.length / columns; o += 4) {
        const rows = [0, 1, 2, 3].map((k) => wholes.slice((o + k) * columns, (o + k + 1) * columns));
        lines.push(`${name}(${[o / 4, ...biases.slice(o, o + 4), ...integers(rows, base, digits)]})`);
    }
    return [...lines, "x=y;}"];
}

/** @param {Op & {kind: "dot"}} op @param {ReturnType<typeof multiplesOf>} multiples @param {number} base */
function printOutput({result, offset}, {wholes, step}, base) {
    const terms = [], block = (/** @type {number} */ k) => wholes.slice(4 * k, 4 * k + 4), count = wholes.length / 4;
    for (let k = 0; k + 1 < count; k += 2) {
        const [one, other] = [block(k), block(k + 1)];
        terms.push(`E(${[k, ...integers(one.map((value, i) => [value, other[i]]), base, 2)]})`);
    }
    if (count % 2) terms.push(`dot(vec4(${block(count - 1)}),x[${count - 1}])`);
    return `float ${result}=${number(step)}*(${terms.join("+")})+(${number(offset)});`;
}

/** Returns the integers of four rows of multiples: four for each group of `digits` columns.
 * @param {number[][]} rows @param {number} base @param {number} digits */
function integers(rows, base, digits) {
    const result = [];
    for (let k = 0; k < rows[0].length; k += digits) {
        for (const row of rows) {
            const chunk = row.slice(k, k + digits);
            result.push(chunk.reduce((sum, value, place) => sum + (value + (base - 1) / 2) * base ** place, 0));
        }
    }
    return result;
}

/** Returns the macro that computes y[j] from the biases and integers of four rows.
 * @param {string} name @param {number} columns @param {number} digits @param {boolean} biased */
function rowMacro(name, columns, digits, biased) {
    const all = [..."abcdefghijklmnopqrstuvwxyz"], letters = all.filter((letter) => !"jxy".includes(letter));
    const nameOf = (/** @type {number} */ k) =>
        letters[k] ?? all[(k - letters.length) % 26] + Math.floor((k - letters.length) / 26);
    const names = Array.from({length: 4 * columns / digits + 4 * Number(biased)}, (_, k) => nameOf(k));
    let used = 0;
    const four = () => names.slice(used, used += 4), terms = biased ? [`vec4(${four()})`] : [];
    for (let i = 0; i < columns / 4; ++i) {
        const matrix = digits === 4 ? `M(ivec4(${four()}))` : `N(ivec4(${four()}),ivec4(${four()}))`;
        terms.push(`${matrix}*x[${i}]`);
    }
    return `#define ${name}(j,${names})y[j]=sin(S*(${terms.join("+")}));`;
}
