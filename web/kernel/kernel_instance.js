import {FACTORS, parameterCount, RESULT, SAMPLE, TILE, VALUE} from "./kernel.js";

/** The kernel's functions (siren.c).
 * @typedef {{memory: WebAssembly.Memory,
 *     prepare: (width: number, depth: number, outputs: number, most: number) => void,
 *     evaluate: (count: number) => void, prepare_matrices: (depth: number, width: number) => number,
 *     orthogonalize: (coefficients: number) => void,
 *     level_step: (count: number, on: number, allOn: number, allAround: number) => void,
 *     texture_step: (count: number, on: number, allOn: number, all: number, smoothness: number) => void
 *     } & Record<`${"weights" | "gradient" | "samples" | "results" | "terms" | "factors"}_at`, () => number>
 *     } KernelExports */
/** A network in the WebAssembly kernel. */
export class Kernel {
    /** @param {WebAssembly.Module} module the compiled kernel */
    constructor(module) {
        this.exports = /** @type {KernelExports} */ (new WebAssembly.Instance(module).exports);
        this.most = 0;
        this.weights =
            this.gradient =
            this.samples =
            this.results =
            this.terms =
            this.factors =
                new Float32Array();
    }

    /** Prepares for a network, and for at most `most` samples. Arrays of an earlier network are lost.
     * @param {KernelNetwork} network @param {number} most */
    prepare(network, most) {
        const {exports} = this;
        exports.prepare(network.width, network.depth, network.outputs, most);
        /** @param {() => number} at @param {number} count */
        const floats = (at, count) => new Float32Array(exports.memory.buffer, at(), count);
        this.most = most;
        this.weights = floats(exports.weights_at, parameterCount(network));
        this.gradient = floats(exports.gradient_at, parameterCount(network));
        this.samples = floats(exports.samples_at, SAMPLE * most);
        this.results = floats(exports.results_at, RESULT * most);
        this.terms = floats(exports.terms_at, 5);
        this.factors = floats(exports.factors_at, FACTORS.length);
    }

    /** Sets the factors of a level's loss, by the names of `LossWeights` in trainer/config.py.
     * @param {Record<string, number>} weights */
    setLoss(weights) {
        this.factors.set(FACTORS.map((name) => weights[name]));
    }

    /** Evaluates the network at rows of SAMPLE floats, and adds its value and gradient to each row's columns 4 to 7.
     * @param {Float32Array} rows */
    addField(rows) {
        for (let start = 0; start < rows.length; start += SAMPLE * this.most) {
            const part = rows.subarray(start, start + SAMPLE * this.most), count = part.length / SAMPLE;
            this.samples.set(part);
            this.exports.evaluate(TILE * Math.ceil(count / TILE));
            for (let i = 0; i < count; ++i) {
                for (let k = 0; k < RESULT; ++k) part[SAMPLE * i + VALUE + k] += this.results[RESULT * i + k];
            }
        }
    }
}
