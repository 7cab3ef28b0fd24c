import {DISTANCE, SAMPLE} from "../kernel/kernel.js";
import {nearbyInTurn} from "./morton_order.js";

/** A shape to train on. isExact: its distances.
 * @typedef {Surface & {vertices: Float64Array, isExact?: boolean,
 *     distance(x: number, y: number, z: number): number,
 *     surface(count: number, random: () => number, colors?: Float32Array | null): Float32Array}} TrainingShape */

/** What meshes and point clouds to train on have in common, by their own vertices, surface() and distance(). */
export class Surface {
    /** Returns rows of every `step`-th vertex, from the `first` one on.
     * @this {TrainingShape} @param {number} first @param {number} step */
    corners(first, step) {
        const rows = new Float32Array(SAMPLE * Math.ceil((this.vertices.length / 3 - first) / step));
        for (let at = 0, i = first; at < rows.length; at += SAMPLE, i += step) {
            rows.set(this.vertices.subarray(3 * i, 3 * i + 3), at);
        }
        return rows;
    }

    /** Sets the signed distances of rows of samples. @this {TrainingShape} @param {Float32Array} rows */
    setDistances(rows) {
        for (const at of nearbyInTurn(rows)) {
            rows[at + DISTANCE] = this.distance(rows[at], rows[at + 1], rows[at + 2]);
        }
    }
}
