import {CLIP, TOLERANCE, TRAINED_FINE, TRAINED_HIDDEN} from "./constants.js";

// Quantized weights, bit for bit as model/quantize.py: integer multiples of a step, which take few characters as text.

// Sizes of quantized training. fine, hidden: largest multiples in the first and last layers, and in the matrices of
// hidden layers; clip: largest weight of a hidden layer, in standard deviations of its weights.
const TRAINED = {fine: TRAINED_FINE, hidden: TRAINED_HIDDEN, clip: CLIP};
const DECIMALS = 1e5; // of the last layer's bias
const HALVES = 1.5 * 2 ** 52; // adding it to a positive number rounds away the digits after the point, half to even
const TOGETHER_SUMMED = 128, SUMS = new Float32Array(8); // see sumInPairs()

/** Returns whether every layer of a network {rows, columns, weight, bias} is quantized. @param {Network} network */
export function isQuantized(network) {
    const first = network[0], last = network.at(-1);
    return [first.weight, first.bias, ...rowsOf(last)].every((values) => stepOf(values, TRAINED.fine) !== null)
        && network.slice(1, -1).every(({weight, bias}) => {
            const step = stepOf(weight, TRAINED.hidden);
            return step !== null && areMultiples(bias, step);
        });
}

/** Returns the nearest quantized network. sizes: see TRAINED. @param {Network} network */
export function quantized(network, sizes = TRAINED) {
    const copies = network.map((layer) => ({...layer, weight: layer.weight.slice(), bias: layer.bias.slice()}));
    return quantizedNetwork(network, copies, sizes);
}

/** Writes the nearest quantized network into `result`, a network of the same shape, and returns it. It may be
 * `network`.
 * @param {Network} network @param {Network} result */
export function quantizedNetwork(network, result, {fine, hidden, clip} = TRAINED) {
    network.forEach((layer, j) => {
        const {weight, bias} = layer, to = result[j];
        if (j === network.length - 1) {
            const rows = rowsOf(to);
            rowsOf(layer).forEach((row, o) => roundFinely(row, rows[o], fine));
            bias.forEach((value, o) => {
                to.bias[o] = nearestWhole(value * DECIMALS) / DECIMALS;
            });
        } else if (j === 0) {
            roundFinely(weight, to.weight, fine);
            roundFinely(bias, to.bias, fine);
        } else {
            const step = threeDigits(Math.min(clip * deviation(weight), largestOf(weight)) / hidden);
            roundTo(weight, to.weight, step, hidden);
            roundTo(bias, to.bias, step, Infinity);
        }
    });
    return result;
}

/** Clamps the matrices of a network's hidden layers, in place, to the largest weights of the quantized network.
 * @param {Network} network @param {Network} result */
export function clampToQuantized(network, result) {
    for (let j = 1; j < network.length - 1; ++j) {
        const {weight} = network[j], most = largestOf(result[j].weight);
        for (let i = 0; i < weight.length; ++i) weight[i] = Math.max(-most, Math.min(most, weight[i]));
    }
}

/** Returns the largest step such that all values are multiples of it, up to `largest`; null if there is none. Zeros
 * have the step 1.
 * @param {Float32Array} values @param {number} largest */
export function stepOf(values, largest) {
    const top = largestOf(values);
    for (let count = 1; top && count <= largest; ++count) {
        const step = withDigits(top / count, 6);
        if (areMultiples(values, step)) return step;
    }
    return top ? null : 1;
}

/** Rounds a number to `digits` digits as Python does: of two equally near decimals, it takes the even one.
 * @param {number} x @param {number} digits */
export function withDigits(x, digits) {
    const text = x.toExponential(digits - 1);
    if (!/5e/.test(x.toExponential(digits))) return Number(text);
    const [mantissa, exponent] = x.toExponential(60).split("e"), end = mantissa.indexOf(".") + digits;
    const below = mantissa.slice(0, end);
    return /^50*$/.test(mantissa.slice(end)) && Number(below.at(-1)) % 2 === 0
        ? Number(`${below}e${exponent}`)
        : Number(text);
}

/** Rounds to the nearest whole number, half to even; keeps the sign of 0. |x| < 2^51. @param {number} x */
export function nearestWhole(x) {
    return Math.sign(x) * (Math.abs(x) + HALVES - HALVES);
}

/** @param {Float32Array} values @param {number} step */
function areMultiples(values, step) {
    return values.every((value) => Math.abs(value / step - nearestWhole(value / step)) < TOLERANCE);
}

/** @param {Layer} layer */
function rowsOf({rows, columns, weight}) {
    return Array.from({length: rows}, (_, o) => weight.subarray(o * columns, (o + 1) * columns));
}

const threeDigits = (/** @type {number} */ step) => withDigits(step, 3) || 1;

/** @param {Float32Array} values @param {Float32Array} to @param {number} most */
function roundFinely(values, to, most) {
    roundTo(values, to, threeDigits(largestOf(values) / most), most);
}

/** @param {Float32Array} values @param {Float32Array} to @param {number} step @param {number} most */
function roundTo(values, to, step, most) {
    for (let i = 0; i < values.length; ++i) {
        to[i] = Math.max(-most, Math.min(most, nearestWhole(values[i] / step))) * step;
    }
}

/** @param {Float32Array} values */
function largestOf(values) {
    let most = 0;
    for (let i = 0; i < values.length; ++i) most = Math.max(most, Math.abs(values[i]));
    return most;
}

/** Returns the standard deviation of 32-bit floats, in 32 bits as NumPy does. @param {Float32Array} values */
function deviation(values) {
    const {fround} = Math, count = values.length, mean = fround(sumInPairs(values, 0, count, 0, 1) / count);
    return fround(Math.sqrt(fround(sumInPairs(values, 0, count, mean, 2) / count)));
}

/** Adds the powers 1 or 2 of differences from a center, in 32 bits and in NumPy's order: halves down to
 * TOGETHER_SUMMED, then eight sums at once.
 * @param {Float32Array} values @param {number} start @param {number} count @param {number} center
 * @param {1 | 2} power @returns {number} */
function sumInPairs(values, start, count, center, power) {
    const {fround} = Math;
    if (count > TOGETHER_SUMMED) {
        const half = (count >> 1) & ~7;
        return fround(
            sumInPairs(values, start, half, center, power)
                + sumInPairs(values, start + half, count - half, center, power),
        );
    }
    const term = (/** @type {number} */ i) => {
        const difference = fround(values[start + i] - center);
        return power === 1 ? difference : fround(difference * difference);
    };
    const together = count & ~7;
    SUMS.fill(0);
    for (let i = 0; i < together; ++i) SUMS[i & 7] += term(i);
    for (const width of [1, 2, 4]) for (let k = 0; k < 8; k += 2 * width) SUMS[k] += SUMS[k + width];
    for (let i = together; i < count; ++i) SUMS[0] += term(i);
    return SUMS[0];
}
