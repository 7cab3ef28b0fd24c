import {SAMPLE, VALUE} from "../kernel/kernel.js";
import {filtered} from "./sampling.js";
/** @import {Kernel} from "../kernel/kernel_instance.js" */

// The networks of a model in the kernel, at rows of samples.
const BLOCK = 4096; // samples that the kernel evaluates at once
/** What the workers need of a network, and of a level.
 * @typedef {Pick<TrainedNetwork, "network" | "weights">} BareNetwork
 * @typedef {Pick<TrainedLevel, "network" | "weights" | "delta">} BareLevel */

/** Adds a network's value and gradient, or its color.
 * @param {Kernel} kernel @param {BareNetwork} network @param {Float32Array} rows */
export function addNetwork(kernel, {network, weights}, rows) {
    kernel.prepare(network, BLOCK);
    kernel.weights.set(weights);
    kernel.addField(rows);
}

/** Adds value and gradient of the finest level defined at each row (Eq. 3). Returns the level of each, from 0. margin:
 * by which the bands are wider. @param {Kernel} kernel @param {BareLevel[]} levels @param {Float32Array} rows */
export function addNested(kernel, levels, rows, margin = 0) {
    const reached = new Uint8Array(rows.length / SAMPLE);
    levels.forEach((level, i) => {
        const isInside = (/** @type {number} */ at) => (
            !i || (reached[at / SAMPLE] === i - 1 && Math.abs(rows[at + VALUE]) < levels[i - 1].delta + margin)
        );
        const inside = filtered(rows, isInside);
        addNetwork(kernel, level, inside);
        for (let at = 0, from = 0; at < rows.length; at += SAMPLE) {
            if (!isInside(at)) continue;
            reached[at / SAMPLE] = i;
            rows.set(inside.subarray(from, from + SAMPLE), at);
            from += SAMPLE;
        }
    });
    return reached;
}
