import {shared} from "../model/facts.js";
import {fieldValue, widenedValues} from "../print/reference.js";

// Finds the height of a model's lowest point at time 0, for the floor of the shading softbox, as field/lowest.py on a
// coarser grid,
// layer by layer from the bottom. Without a surface, it is -1.
const LAYERS = 32;
const MORE = 2; // layers searched above the first layer with the surface

/** @param {Model} model */
export function lowestPoint(model) {
    const reach = Math.sqrt(3) * shared.cells.overestimate / LAYERS,
        at = (/** @type {number} */ i) => (2 * i + 1) / LAYERS - 1;
    let lowest = Infinity;
    for (let layer = 0, left = MORE; layer < LAYERS && left >= 0; ++layer) {
        const points = Array.from(
            {length: LAYERS ** 2},
            (_, k) => [at(k % LAYERS), at(layer), at(Math.floor(k / LAYERS))],
        )
            .filter((point) => Math.hypot(...point) <= 1 + reach);
        widenedValues(model, points, 0, reach).forEach((value, k) => {
            if (Math.abs(value) < reach) lowest = Math.min(lowest, landed(model, points[k]));
        });
        if (lowest < Infinity) --left;
    }
    return lowest < Infinity ? lowest : -1;
}

/** Returns the height at which Newton's method moves a point onto the surface; Infinity if it does not.
 * @param {Model} model @param {Vector} point */
function landed(model, point) {
    const step = 1e-3, value = (/** @type {Vector} */ p) => fieldValue(model, p)[0];
    for (let i = 0; i < 5; ++i) {
        const f = value(point);
        if (Math.abs(f) < 1e-3) return Math.hypot(...point) < 1.1 ? point[1] : Infinity;
        const slope = [0, 1, 2].map((k) => (value(point.map((c, j) => c + (j === k ? step : 0))) - f) / step);
        const steepness = Math.max(slope.reduce((sum, c) => sum + c * c, 0), 0.25);
        point = point.map((c, k) => c - f / steepness * slope[k]);
    }
    return Infinity;
}
