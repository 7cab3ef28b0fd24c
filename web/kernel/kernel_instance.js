import {FACTORS, parameterCount, RESULT, SAMPLE, TILE, VALUE} from "./kernel.js";

// A network in the WebAssembly kernel.
export class Kernel {
    // module: the compiled WebAssembly.Module.
    constructor(module) {
        this.exports = new WebAssembly.Instance(module).exports;
    }

    // Prepares for a network, and for at most `most` samples. Arrays of an earlier network are lost.
    prepare(network, most) {
        const {exports} = this;
        exports.prepare(network.width, network.depth, network.outputs, most);
        const floats = (at, count) => new Float32Array(exports.memory.buffer, at(), count);
        this.most = most;
        this.weights = floats(exports.weights_at, parameterCount(network));
        this.gradient = floats(exports.gradient_at, parameterCount(network));
        this.samples = floats(exports.samples_at, SAMPLE * most);
        this.results = floats(exports.results_at, RESULT * most);
        this.terms = floats(exports.terms_at, 5);
        this.factors = floats(exports.factors_at, FACTORS.length);
    }

    // Sets the factors of a level's loss, by the names of `LossWeights` in trainer/config.py.
    setLoss(weights) {
        this.factors.set(FACTORS.map((name) => weights[name]));
    }

    // Evaluates the network at rows of SAMPLE floats, and adds its value and gradient to each row's columns 4 to 7.
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
