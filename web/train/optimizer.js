import {INPUTS} from "../kernel/kernel.js";
import {
    EPSILON,
    MEAN,
    MOMENTUM,
    NARROWEST,
    NEWTON_SCHULZ,
    ROOT_MEAN_SQUARE,
    VARIANCE,
    WARM_UP,
} from "../model/constants.js";
/** @import {Task} from "./optimize.js" */

/** The optimizer of a network, as in trainer/networks/muon.py: Muon (Jordan et al. 2024) moves the matrices of hidden
 * layers; Adam (Kingma and Ba 2015) moves all else, the output layer at a rate of its own. */
export class Optimizer {
    /** @param {Float32Array} weights in the kernel's order @param {Task} task
     * @param {number} rate of all but the output layer */
    constructor(weights, {network: {width, depth}, layout, outputs, outputFactor, kernel}, rate) {
        const size = width * width, output = weights.length - outputs;
        const hidden = Array.from({length: depth}, (_, j) => (INPUTS + 1) * width + j * (size + width)); // first floats
        const starts = [0, ...hidden.map((at) => at + size), output], ends = [...hidden, output, weights.length];
        const parts = starts.map((start, k) => ({
            start,
            end: ends[k],
            rate: start < output ? rate : outputFactor * rate,
        }));
        const at = kernel.prepare_matrices(depth, width); // replaces the buffer where that has no room
        const matrices = new Float32Array(kernel.memory.buffer, at, depth * size);
        this.weights = weights;
        this.kernel = kernel;
        this.hidden = hidden;
        this.size = size;
        this.parts = parts;
        this.matrices = matrices;
        this.steps = 0;
        this.matrixRate = ROOT_MEAN_SQUARE * Math.sqrt(Math.max(layout.width, NARROWEST)) * rate;
        this.means = new Float32Array(weights.length);
        this.squares = new Float32Array(weights.length); // of Adam only
    }

    /** Takes a step with `factor` times the rates.
     * @param {Float32Array[]} gradients whose sum is the gradient @param {number} factor */
    step(gradients, factor) {
        const gradient = new Float32Array(this.weights.length);
        for (const own of gradients) for (let i = 0; i < gradient.length; ++i) gradient[i] += own[i];
        ++this.steps;
        for (const part of this.parts) this.moveByAdam(part, gradient, factor);
        this.moveByMuon(gradient, factor);
    }

    /** @param {Record<"start" | "end" | "rate", number>} part @param {Float32Array} gradient @param {number} factor */
    moveByAdam({start, end, rate}, gradient, factor) {
        const {weights, means, squares, steps} = this;
        const bias = 1 - MEAN ** steps, root = Math.sqrt(1 - VARIANCE ** steps);
        for (let i = start; i < end; ++i) {
            const g = gradient[i];
            means[i] += (1 - MEAN) * (g - means[i]);
            squares[i] += (1 - VARIANCE) * (g * g - squares[i]);
            weights[i] -= factor * rate / bias * means[i] / (Math.sqrt(squares[i]) / root + EPSILON);
        }
    }

    /** @param {Float32Array} gradient @param {number} factor */
    moveByMuon(gradient, factor) {
        const {weights, means, matrices, hidden, size, kernel} = this, rate = factor * this.matrixRate;
        hidden.forEach((at, j) => {
            for (let i = 0; i < size; ++i) {
                const g = gradient[at + i], mean = means[at + i] += (1 - MOMENTUM) * (g - means[at + i]);
                matrices[j * size + i] = g + MOMENTUM * (mean - g); // Nesterov
            }
        });
        kernel.orthogonalize(NEWTON_SCHULZ);
        hidden.forEach((at, j) => {
            for (let i = 0; i < size; ++i) weights[at + i] -= rate * matrices[j * size + i];
        });
    }
}

/** Returns the factor on the learning rate at a share of the schedule (trainer/networks/fit.py).
 * @param {number} share */
export function schedule(share, warmUp = WARM_UP) {
    return share < warmUp ? share / warmUp : 0.5 + 0.5 * Math.cos(Math.PI * (share - warmUp) / (1 - warmUp));
}
