import {pause} from "../model/pause.js";
import {isQuantized, quantized} from "../model/quantize.js";
import {valuesAt, widenedValues} from "./reference.js";

// Rounds the weights of a model to the fewest bits that keep its surface and its colors, as field/bits.py without the
// compensation of errors.
// Allowed root mean square errors: of f as a share of the last delta, but not below LEAST; of the normal in degrees; of
// the colors in steps of 1/255.
const SHARE = 0.5, LEAST = 3e-4, ANGLE = 0.7, OFF_COLOR = 2.3;
// Candidates for the largest multiple of a hidden layer's step. LARGEST_MULTIPLE of packed.js is the last one.
const SIZES = [
    ...[7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 20, 23, 27, 31, 37, 44, 53, 64, 77, 91, 107],
    ...[161, 322, 645, 1023, 2047, 4095, 8191],
];
const FINE = 2047; // least of the largest multiples in first and last layers
const STARTS = 400, FEWEST = 50; // points of the search for the surface, and fewest that must arrive
const STRIDES = [0.8191725134, 0.6710436067, 0.5497004779]; // of a low-discrepancy sequence
const HALF_CUBE = 0.9, NEWTON_STEPS = 4, NEIGHBOR = 1e-3;

/** Resolves to {model, error}: the model with quantized networks, and its error {f, degrees, colour}, null if they
 * were quantized already. Resolves to null if no number of bits keeps the errors in their limits, or without a
 * surface.
 * @param {Model} model */
export async function fewestBits(model) {
    const {levels, texture} = model;
    if ([...levels.map(({network}) => network), ...(texture ? [texture] : [])].every(isQuantized)) {
        return {model, error: null};
    }
    const points = await surfacePoints(model, 0);
    if (points.length < FEWEST) return null;
    const rounded = {...model, levels: [...levels]}, exact = valuesNear(model, points);
    const sizes = levels.map(({network}) => network.reduce((sum, {weight}) => sum + weight.length, 0));
    const limit = Math.max(SHARE * levels.at(-1).delta, LEAST);
    const upTo = (/** @type {number} */ count) => sizes.slice(0, count).reduce((sum, size) => sum + size, 0);
    for (const [i, level] of levels.entries()) {
        // Errors of levels are independent: their squares add up. The text is shortest if they are as the sizes.
        const share = Math.sqrt(upTo(i + 1) / upTo(levels.length));
        const fits = (/** @type {Network} */ candidate) => {
            rounded.levels[i] = {...level, network: candidate};
            const {f, degrees} = errorsOf(exact, valuesNear(rounded, points));
            return f <= share * limit && degrees <= share * ANGLE;
        };
        // The last level has what the others leave.
        const network = await fewestSizes(level.network, fits) ?? (i + 1 < levels.length && finest(level.network));
        if (!network) return null;
        rounded.levels[i] = {...level, network};
    }
    let colour = null;
    if (texture) {
        const color = colorsAt(model, texture, points);
        const errorOf = (/** @type {Network} */ other) => colorError(color, colorsAt(model, other, points));
        const network = await fewestSizes(texture, (candidate) => errorOf(candidate) <= OFF_COLOR);
        if (!network) return null;
        rounded.texture = network;
        colour = {colour: errorOf(network)};
    }
    await pause(0);
    return {model: rounded, error: {...errorsOf(exact, valuesNear(rounded, points)), ...colour}};
}

/** Resolves to points [x, y, z] on the last level's surface at a time. @param {Model} model @param {number} time */
export async function surfacePoints(model, time) {
    let points = Array.from({length: STARTS}, (_, k) => STRIDES.map((s) => HALF_CUBE * (2 * ((k + 1) * s % 1) - 1)));
    for (let i = 0; i < NEWTON_STEPS; ++i) {
        const jets = jetsOf(widenedValues(model, withNeighbors(points), time, 0));
        points = points.map((point, k) => {
            const [f, ...gradient] = jets[k], steepness = Math.max(innerProduct(gradient, gradient), 0.25);
            return point.map((c, axis) => c - f / steepness * gradient[axis]);
        });
        await pause(0);
    }
    const values = widenedValues(model, points, time, Infinity), {delta} = model.levels.at(-1);
    return points.filter((point, k) => Math.abs(values[k]) < delta && Math.hypot(...point) < 1.05);
}

/** Resolves to a network with quantized weights of the fewest bits that fit; null if none fit.
 * @param {Network} network @param {(candidate: Network) => boolean} fits */
async function fewestSizes(network, fits) {
    if (isQuantized(network)) return network;
    let best = null, low = 0, high = SIZES.length;
    while (low < high) {
        await pause(0);
        const middle = (low + high) >> 1, hidden = SIZES[middle];
        const candidate = withSizes(network, hidden);
        if (fits(candidate)) [best, high] = [candidate, middle];
        else low = middle + 1;
    }
    return best;
}

/** @param {Network} network @param {number} hidden */
function withSizes(network, hidden) {
    return quantized(network, {fine: Math.max(FINE, hidden), hidden, clip: Infinity});
}

const finest = (/** @type {Network} */ network) => withSizes(network, SIZES.at(-1));

/** Returns each point, then each moved along x, and so on. @param {Vector[]} points */
function withNeighbors(points) {
    return [-1, 0, 1, 2].flatMap((along) => (
        points.map((point) => point.map((c, axis) => (axis === along ? c + NEIGHBOR : c)))
    ));
}

/** Returns [f, derivatives along x, y, z] of each point, from the values at points of withNeighbors().
 * @param {Float64Array} values */
function jetsOf(values) {
    const count = values.length / 4;
    return Array.from({length: count}, (_, k) => (
        [0, 1, 2, 3].map((part) => (part ? (values[part * count + k] - values[k]) / NEIGHBOR : values[k]))
    ));
}

/** @param {Model} model @param {Vector[]} points */
function valuesNear(model, points) {
    return widenedValues(model, withNeighbors(points), 0, Infinity);
}

/** Returns the root mean square error of f, and of the normal's angle in degrees.
 * @param {Float64Array} values @param {Float64Array} others */
function errorsOf(values, others) {
    const jets = jetsOf(values), pairs = jetsOf(others).map((other, k) => [jets[k], other]);
    return {
        f: rootMeanSquare(pairs.map(([[f], [g]]) => f - g)),
        degrees: rootMeanSquare(pairs.map(([[, ...a], [, ...b]]) => {
            const cosine = innerProduct(a, b) / Math.max(Math.sqrt(innerProduct(a, a) * innerProduct(b, b)), 1e-9);
            return Math.acos(Math.min(cosine, 1)) * 180 / Math.PI;
        })),
    };
}

/** @param {Model} model @param {Network} texture @param {Vector[]} points */
function colorsAt(model, texture, points) {
    return valuesAt(model, texture, points, 0).map((c) => Math.max(0, Math.min(1, c)));
}

/** Returns the root mean square error of colors, in steps of 1/255. @param {Numbers} a @param {Numbers} b */
const colorError = (a, b) => 255 * rootMeanSquare(Array.from(a, (c, i) => c - b[i]));

/** @param {number[]} values */
export const rootMeanSquare = (values) => Math.sqrt(values.reduce((sum, x) => sum + x * x, 0) / values.length);
/** @param {Vector} a @param {Vector} b */
const innerProduct = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
