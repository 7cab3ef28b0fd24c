import {DIGITS_SHARE, MOST_DIGITS} from "../model/constants.js";
import {nearestWhole} from "../model/quantize.js";
import {number} from "./cstyle.js";
import {rootMeanSquare, surfacePoints} from "./few_bits.js";
import {printFunction} from "./field.js";
import {declareLiterals, straight} from "./literal.js";
import {lowered} from "./lower_model.js";
import {widenedValues} from "./reference.js";

// Prints weights with few decimals, byte for byte as codegen/printers/literal.py.
/** @typedef {Layer & {scales: number[]}} ScaledLayer of a network in decimals; the last layer has scales */

const TIMES = [0, 0.25, 0.5, 0.75, 1]; // at which a moving model is measured

/** Resolves to the fewest decimals that keep the surface (field/digits.py). @param {Model} model */
export async function fewestDigits(model) {
    /** @type {{points: Vector[], time: number, values: Float64Array}[]} */ const cases = [];
    for (const time of model.inputs === "xyzt" ? TIMES : [0]) {
        const points = await surfacePoints(model, time);
        cases.push({points, time, values: widenedValues(model, points, time, Infinity)});
    }
    for (let digits = 1; digits < MOST_DIGITS; ++digits) {
        const rounded = (/** @type {Network} */ network) => multiplied(inDecimals(network, digits));
        const levels = model.levels.map((level) => ({...level, network: rounded(level.network)}));
        const isEnough = (/** @type {typeof cases[0]} */ {points, time, values}) => {
            const others = widenedValues({...model, levels}, points, time, Infinity);
            return rootMeanSquare(Array.from(values, (f, k) => f - others[k])) < DIGITS_SHARE * levels.at(-1).delta;
        };
        if (cases.every(isEnough)) return digits;
    }
    return MOST_DIGITS;
}

/** Returns the lines of the weights, and of the functions for the levels' values and the color. nameOf: replaces
 * names of functions.
 * @param {Model} model @param {number} digits @param {(name: string) => string} nameOf */
export function decimalLines(model, digits, nameOf) {
    const levels = model.levels.map((level) => ({...level, network: inDecimals(level.network, digits)}));
    const texture = model.texture && inDecimals(model.texture, digits);
    const {values, texture: color, constants} = lowered({...model, levels, texture});
    const functions = [...values, ...(color ? [color] : [])].map((code) => ({...code, name: nameOf(code.name)}));
    const networks = /** @type {ScaledLayer[][]} */ ([...levels.map(({network}) => network), texture]);
    return [
        ...declareLiterals(functions, constants),
        ...functions.flatMap((code, k) => printFunction(code, withScales(code, networks[k].at(-1).scales))),
    ];
}

/** Returns a network with rounded weights. Rows of the last layer are divided by powers of ten, its `scales`, before.
 * @param {Network} network @param {number} digits @returns {ScaledLayer[]} */
function inDecimals(network, digits) {
    const factor = 10 ** digits;
    const round = (/** @type {Float32Array} */ values) => values.map((x) => nearestWhole(x * factor) / factor);
    return network.map(({rows, columns, weight, bias}, j) => {
        const layer = {rows, columns, weight: round(weight), bias: round(bias), scales: /** @type {number[]} */ ([])};
        for (let o = 0; j === network.length - 1 && o < rows; ++o) {
            const row = weight.subarray(o * columns, (o + 1) * columns), most = Math.max(...row.map(Math.abs));
            const scale = most > 0 ? Number(`1e${Math.floor(Math.log10(most))}`) : 1;
            layer.weight.set(round(row.map((x) => x / Math.fround(scale))), o * columns);
            layer.bias[o] = Number(bias[o].toFixed(digits + 2));
            layer.scales.push(scale);
        }
        return layer;
    });
}

/** Returns a network of inDecimals with its last layer multiplied by the scales. @param {ScaledLayer[]} network */
function multiplied(network) {
    const {columns, scales, weight, ...last} = network.at(-1);
    const product = weight.map((x, i) => x * scales[Math.floor(i / columns)]);
    return [...network.slice(0, -1), {...last, columns, weight: product}];
}

/** Returns a function's statements, whose outputs have scales. @param {Code} code @param {number[]} scales */
function withScales({ops, blocks}, scales) {
    let output = 0;
    return ops.flatMap((op) => {
        const scale = op.kind === "dot" ? scales[output++] : 1;
        const lines = straight({ops: [op], blocks}).map((line) => line.replace(" = sine(", " = sin("));
        if (scale === 1) return lines;
        const [, first, ...others] = lines, {result, offset = 0} = op;
        return [
            first.replace(`${result} +=`, `float ${result} =`),
            ...others,
            `${result} = ${number(scale)} * ${result} + ${number(offset)};`,
        ];
    });
}
