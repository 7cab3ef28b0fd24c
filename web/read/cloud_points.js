import {APART, CANCELED, FEWEST_POINTS, HUGE} from "../model/constants.js";
import {firstEqual} from "./equal_points.js";
import {demand, demandFew} from "./mesh_parts.js";

// Checks and merges the points of a cloud (trainer/shapes/checks.py, duplicates.py).
const INWARDS = 0.1; // least mean cosine of normals that point inwards
/** Points with normals of any length.
 * @typedef {{vertices: Float64Array, normals: Float64Array, tints?: Float32Array | null}} Points */

/** Leaves out points without a place or a normal, averages those at one place, and scales normals to length one.
 * @param {Points} shape */
export function cleanCloud(shape) {
    const notes = [], usable = withUnitNormals(shape);
    const lost = (shape.vertices.length - usable.vertices.length) / 3;
    if (lost) notes.push(`left out ${lost.toLocaleString("en")} points without finite coordinates or a normal`);
    demandFew(usable.vertices.length / 3, "points");
    const merged = mergedPoints(usable), count = merged.vertices.length / 3, less = usable.vertices.length / 3 - count;
    if (less) notes.push(`merged or left out ${less.toLocaleString("en")} points that share a place`);
    demand(count >= FEWEST_POINTS, `${count} points at different places; a cloud needs at least ${FEWEST_POINTS}`);
    if (turnOutwards(merged)) notes.push("the normals point inwards; turned round");
    return {...merged, notes};
}

/** Turns normals round if most of them clearly point to the middle of the points. Returns whether it did.
 * @param {Points} points */
function turnOutwards({vertices, normals}) {
    const count = vertices.length / 3, middle = [0, 0, 0];
    vertices.forEach((c, i) => {
        middle[i % 3] += c / count;
    });
    const lengths = lengthsOf(vertices.map((c, i) => c - middle[i % 3]));
    let along = 0; // sum of cosines
    normals.forEach((c, i) => {
        along += c * (vertices[i] - middle[i % 3]) / (lengths[Math.floor(i / 3)] || 1);
    });
    if (along > -INWARDS * count) return false;
    normals.forEach((c, i) => {
        normals[i] = -c;
    });
    return true;
}

/** @param {Points} points */
function withUnitNormals({vertices, normals, tints}) {
    const lengths = lengthsOf(normals);
    const places = Array.from(lengths, (_, i) => [0, 1, 2].every((k) => Math.abs(vertices[3 * i + k]) <= HUGE));
    return scaledRows({vertices, normals, tints}, lengths, (i) => places[i] && lengths[i] > 0 && lengths[i] < Infinity);
}

/** @param {Float64Array} rows (3 N) */
function lengthsOf(rows) {
    const length = (/** @type {number} */ i) => Math.hypot(rows[3 * i], rows[3 * i + 1], rows[3 * i + 2]);
    return Float64Array.from({length: rows.length / 3}, (_, i) => length(i));
}

/** Returns the rows that are to be kept, with normals divided by their lengths.
 * @param {Points} points @param {Float64Array} lengths @param {(i: number) => boolean} isKept */
function scaledRows({vertices, normals, tints}, lengths, isKept) {
    /** @template {Float64Array | Float32Array | null | undefined} T @param {T} array */
    const kept = (array) => /** @type {T} */ (array && array.filter((_, i) => isKept(Math.floor(i / 3))));
    const units = normals.map((c, i) => c / lengths[Math.floor(i / 3)]);
    return {vertices: kept(vertices), normals: kept(units), tints: kept(tints)};
}

/** @param {Points} points */
function mergedPoints({vertices, normals, tints}) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    vertices.forEach((c, i) => {
        low[i % 3] = Math.min(low[i % 3], c);
        high[i % 3] = Math.max(high[i % 3], c);
    });
    const cell = APART * Math.hypot(...low.map((c, k) => high[k] - c)) / 2;
    const first = firstEqual(vertices.map((c, i) => Math.floor((c - low[i % 3]) / cell)));
    const counts = new Uint32Array(first.length), sums = new Float64Array(normals.length);
    first.forEach((to) => ++counts[to]);
    const means = tints && new Float32Array(tints.length);
    normals.forEach((c, i) => {
        const row = first[Math.floor(i / 3)], to = 3 * row + i % 3;
        sums[to] += c;
        if (tints && means) means[to] += tints[i] / counts[row];
    });
    const lengths = lengthsOf(sums), isKept = (/** @type {number} */ i) => lengths[i] >= CANCELED * counts[i];
    return scaledRows({vertices, normals: sums, tints: means}, lengths, (i) => counts[i] > 0 && isKept(i));
}
