import {shared} from "./facts.js";

// Unpacks the weights of a model file of version 3, bit for bit as model/packed_weights.py and model/range_coder.py.
const CODED = shared.packed, CODED_TOP = 2 ** 32, CODED_LEAST = 2 ** 24;
/** @type {Map<number, number[]>} */ const bells = new Map();

/** Returns the tensors {shape, values} of the networks by name. sizes: prefix -> [inputs, outputs of each layer].
 * Throws an error if the file is damaged.
 * @param {Record<string, number[]>} sizes @param {Uint8Array} bytes */
export function unpackWeights(sizes, bytes) {
    const damaged = () => new RangeError("damaged");
    const {widest, offset, bias, change, widest_bell: most} = CODED, tensors = [];
    const isWidth = (/** @type {number} */ n) => n >= 1 && n <= widest && n % 1 === 0;
    let count = 0, range = CODED_TOP - 1, code = 0, at = 0;
    for (const widths of Object.values(sizes ?? {})) {
        if (!Array.isArray(widths) || widths.length < 3 || !widths.every(isWidth)) throw damaged();
        widths.reduce((columns, rows) => (count += columns * rows, rows));
    }
    if (count > Math.min(CODED.most_weights, CODED.weights_of_a_byte * bytes.length) || bytes.length < 4)
        throw damaged();
    const byte = () => {
        if (at >= bytes.length) throw damaged();
        code = code % CODED_LEAST * 256 + bytes[at++];
    };
    for (let i = 0; i < 4; ++i) byte();
    /** @param {number} part @param {number} start @param {number} size */
    const take = (part, start, size) => {
        code -= part * start;
        range = part * size;
        for (; range < CODED_LEAST; range *= 256) byte();
    };
    const plain = (/** @type {number} */ total) => {
        const part = Math.floor(range / total), number = Math.min(Math.floor(code / part), total - 1);
        take(part, number, 1);
        return number;
    };
    const number = (/** @type {number} */ quarters) => {
        const shift = Math.max(0, Math.ceil((quarters - CODED.coarsest) / 4));
        const starts = bellOf(Math.max(CODED.finest, quarters) - 4 * shift), total = starts.at(-1);
        const part = Math.floor(range / total), wanted = Math.min(Math.floor(code / part), total - 1);
        let low = 0, high = starts.length - 1; // starts[low] <= wanted < starts[high]
        while (high - low > 1) {
            const middle = (low + high) >> 1;
            if (starts[middle] <= wanted) low = middle;
            else high = middle;
        }
        take(part, starts[low], starts[low + 1] - starts[low]);
        let value = low - (starts.length - 3) / 2;
        if (low === starts.length - 2) {
            value = plain(4096) * 4096 + plain(4096);
            if (value >= 2 ** 23) value -= 2 ** 24;
        }
        return value * 2 ** shift + plain(2 ** shift);
    };
    for (const [prefix, widths] of Object.entries(sizes))
        for (let j = 1; j < widths.length; ++j) {
            const columns = widths[j - 1], rows = widths[j];
            const weight = new Float32Array(rows * columns), biases = new Float32Array(rows);
            const [width, biasWidth, first] = [0, 0, 0].map(() => plain(2 * offset) - offset), exponents = [first];
            for (let i = 1; i < rows; ++i) exponents.push(exponents[i - 1] + number(change));
            if (exponents.some((e) => Math.abs(e) > offset || Math.max(width, biasWidth) - 2 * e > most))
                throw damaged();
            exponents.forEach((e, i) => {
                for (let k = 0; k < columns; ++k) weight[i * columns + k] = number(width - 2 * e) * rootPower(2 * e);
                biases[i] = number(biasWidth - 2 * e) * (rootPower(2 * e) / bias);
            });
            const name = `${prefix}.layer${j - 1}`;
            tensors.push([`${name}.weight`, {shape: [rows, columns], values: weight}]);
            tensors.push([`${name}.bias`, {shape: [rows], values: biases}]);
        }
    if (code || bytes.subarray(at).some(Boolean)) throw damaged();
    return tensors;
}

/** Returns the sums of the sizes of the numbers -most to most, and of the others, for a deviation 2^(quarters / 4).
 * @param {number} quarters */
function bellOf(quarters) {
    if (bells.has(quarters)) return /** @type {number[]} */ (bells.get(quarters));
    const deviation = rootPower(quarters), most = Math.floor(4 * deviation), heights = [];
    for (let n = 0; n <= most; ++n) {
        let height = 1 - n * n / (16 * deviation * deviation);
        for (let k = 0; k < 3; ++k) height *= height;
        heights.push(height);
    }
    let total = heights[0];
    for (const height of heights.slice(1)) total += 2 * height;
    const factor = (CODED.total - 2 * most - 8) / total, starts = [0];
    const sizes = heights.map((height) => Math.floor(height * factor) + 1);
    for (const size of [...sizes.slice(1).reverse(), ...sizes, 2]) starts.push(starts.at(-1) + size);
    bells.set(quarters, starts);
    return starts;
}

/** Returns 2^(quarters / 4). @param {number} quarters */
const rootPower = (quarters) => CODED.quarters[quarters & 3] * 2 ** (quarters >> 2);
