import {facts} from "./facts.js";

// The axis of a file that points up (model/orientation.py). The page trains in the axes of the file, and turns the shape
// by turning the first layer's weights, so that a turn needs no further training.

/** Returns vectors (3 N numbers) of a file whose axis `up` points up, turned to y up. inverse: turns them back.
 * @template {Vector | Float32Array | Float64Array} T @param {T} vectors @param {Up} up */
export function turned(vectors, up, inverse = false) {
    if (up === "y") return vectors;
    const m = facts.studio.upright[up], result = /** @type {T} */ (vectors.slice());
    for (let i = 0; i < vectors.length; i += 3) {
        for (let k = 0; k < 3; ++k) {
            const row = inverse ? [m[0][k], m[1][k], m[2][k]] : m[k];
            result[i + k] = row[0] * vectors[i] + row[1] * vectors[i + 1] + row[2] * vectors[i + 2];
        }
    }
    return result;
}
