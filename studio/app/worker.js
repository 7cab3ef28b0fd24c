import {Batches, randomNumbers} from "./batches.js";
import {DISTANCE, GRADIENT, Kernel, NORMAL, SAMPLE, VALUE} from "./kernel.js";
import {bandSamples, domainSamples, findStrays} from "./sampling.js";
import {Shape} from "./shape.js";
import {TrainingError} from "./training_error.js";

// A worker of a training. It has the shape, draws its own share of the samples, and computes its share of each step.
const BLOCK = 4096; // samples that the kernel evaluates at once

let kernel = null, shape = null, task = null, surface = null, volume = null;

const answers = {
    // module: the compiled kernel; vertices, faces: of the shape, in model space.
    load({module, vertices, faces}) {
        kernel = new Kernel(module);
        shape = new Shape(vertices, faces);
    },

    // Draws the samples of a level, and prepares for its steps. network: {width, depth, outputs}; levels: the levels
    // before, [{network, weights, delta}]; pool: number of samples on the surface, and off it; on, around: the same for
    // one step; team: number of workers; seed: of all random numbers; config: `SamplingConfig` of trainer/config.py.
    begin({network, levels, pool, on, around, team, seed, config}) {
        task = {on, around, team};
        const random = randomNumbers(seed), rows = shape.surface(pool, random);
        addLevels(levels, rows, false);
        surface = new Batches(rows, random);
        volume = new Batches(volumeSamples(levels, pool, team, config, random), random);
        kernel.prepare(network, on + around);
    },

    // Returns this worker's share of the gradient and of the terms. loss: `LossWeights`.
    step({weights, loss}) {
        const {on, around, team} = task;
        kernel.weights.set(weights);
        kernel.setLoss(loss);
        surface.draw(on, kernel.samples, 0);
        volume.draw(around, kernel.samples, on);
        kernel.exports.level_step(on + around, on, on * team, around * team);
        return {gradient: kernel.gradient.slice(), terms: kernel.terms.slice()};
    },

    // Measures the last of the levels on the surface: at `count` new points and at this worker's share of the vertices.
    // Returns {count, f, angle: sums over new points; largest, steepest: largest |f| and |grad f| of all points}.
    measure({levels, count, seed, worker, team}) {
        task = null;
        const drawn = shape.surface(count, randomNumbers(seed));
        const result = {count, f: 0, angle: 0, largest: 0, steepest: 0};
        for (const rows of [drawn, shape.corners(worker, team)]) {
            addLevels(levels, rows, false);
            for (let at = 0; at < rows.length; at += SAMPLE) {
                const f = Math.abs(rows[at + VALUE]), gradient = rows.subarray(at + GRADIENT, at + DISTANCE);
                result.largest = Math.max(result.largest, f);
                result.steepest = Math.max(result.steepest, Math.hypot(...gradient));
                if (rows !== drawn) continue;
                result.f += f;
                result.angle += angleBetween(gradient, rows.subarray(at + NORMAL, at + SAMPLE));
            }
        }
        return result;
    },
};

function angleBetween(gradient, normal) {
    const along = gradient[0] * normal[0] + gradient[1] * normal[1] + gradient[2] * normal[2];
    return Math.acos(Math.min(1, Math.max(-1, along / Math.max(Math.hypot(...gradient), 1e-8))));
}

function volumeSamples(levels, pool, team, config, random) {
    if (!levels.length) return domainSamples(shape, pool, config, random);
    const {delta} = levels[levels.length - 1], addField = (rows) => addLevels(levels, rows, true);
    const strays = findStrays(shape, delta, addField, Math.floor(pool * config.stray_share), 1 / team, config, random);
    return bandSamples(shape, pool, delta, addField, strays, config, random);
}

// Adds the values and gradients of levels to rows of samples. nested: makes the value infinite where a level is not
// defined, outside the bands before it (Eq. 3).
function addLevels(levels, rows, nested) {
    for (const {network, weights, delta} of levels) {
        kernel.prepare(network, BLOCK);
        kernel.weights.set(weights);
        kernel.addField(rows);
        for (let at = VALUE; nested && at < rows.length; at += SAMPLE) {
            if (!(Math.abs(rows[at]) < delta)) rows[at] = Infinity;
        }
    }
}

self.onmessage = ({data: {id, name, data}}) => {
    try {
        self.postMessage({id, answer: answers[name](data)});
    } catch (error) {
        self.postMessage({id, error: error.message ?? String(error), isExpected: error instanceof TrainingError});
    }
};
