import {randomNumbers} from "./batches.js";
import {fit} from "./fit.js";
import {INPUTS, parameterCount, TILE} from "./kernel.js";

// The training of a mesh: level after level, each frozen before the next begins (trainer/train.py).

// Draws the weights of a new level, in the kernel's order (`initial` of trainer/networks/network.py). The weights of
// the time and of padding neurons are zero. padded: width with padding.
export function initialWeights({width, depth}, padded, omega, outputFactor, random) {
    const weights = new Float32Array(parameterCount({width: padded, depth, outputs: 1}));
    const uniform = (bound) => (2 * random() - 1) * bound, bound = Math.sqrt(6 / width);
    let at = INPUTS * padded;
    for (let o = 0; o < width; ++o) {
        for (let k = 0; k < 3; ++k) weights[INPUTS * o + k] = uniform(omega / 3);
        weights[at + o] = uniform(Math.PI);
    }
    at += padded;
    for (let j = 0; j < depth; ++j, at += (padded + 1) * padded) {
        for (let o = 0; o < width; ++o) for (let k = 0; k < width; ++k) weights[at + o * padded + k] = uniform(bound);
    }
    for (let k = 0; k < width; ++k) weights[at + k] = uniform(bound / omega * outputFactor);
    return weights;
}

// Trains the levels of a mesh that the team has loaded.
// settings: {levels: [{width, depth}], omegas, steps, seed}; config: `TrainingConfig` of trainer/config.py.
// afterStep: called after each step with {level, steps, share, loss, terms, weights, levels, network, layout}, of the
// level and of finished levels; may return a promise; "stop" ends the training.
// Returns the levels: [{network, weights, delta, lipschitz, meanF, angle, steps}].
export async function trainMesh(team, settings, config, afterStep) {
    const levels = [], size = team.workers.length;
    for (const [i, layout] of settings.levels.entries()) {
        const network = {width: 4 * Math.ceil(layout.width / 4), depth: layout.depth, outputs: 1};
        const steps = settings.steps[i], seed = settings.seed * 1000 + i, delta = i ? levels[i - 1].delta : null;
        const pool = Math.ceil(poolSize(steps, config.sampling) / size);
        const part = TILE * Math.max(1, Math.round(Math.min(config.step.batch / 2 / size, pool) / TILE));
        await team.all("begin", (k) => ({
            network, levels: levels.map(asQuestion), pool, on: part, around: part, team: size, seed: seed * size + k,
            config: config.sampling,
        }));
        const {rate, outputFactor} = rates(layout.width, delta, config.step);
        const random = randomNumbers(seed), outputs = i ? config.step.residual_output : 1;
        const outcome = await fit(team, {
            start: () => initialWeights(layout, network.width, settings.omegas[i], outputs, random),
            loss: (share) => lossAt(share, i === 0, config.loss), rate, outputFactor, outputs: network.width + 1,
        }, (step) => step / steps, (state) => afterStep({...state, level: i + 1, levels, network, layout}));
        levels.push({network, layout, weights: outcome.weights, steps: outcome.steps, delta: 1});
        Object.assign(levels[i], await measured(team, levels, config.measuring, settings.seed));
        if (outcome.isStopped) break;
    }
    return levels;
}

function asQuestion({network, weights, delta}) {
    return {network, weights, delta};
}

function poolSize(steps, {pool_per_step: each, smallest_pool: least, largest_pool: most}) {
    return Math.min(Math.max(steps * each, least), most);
}

// `rates` of trainer/level.py.
function rates(width, delta, step) {
    const most = delta === null ? Infinity : step.output_factor_per_delta * delta;
    return {rate: step.rate * Math.min(1, step.rate_width / width), outputFactor: Math.min(step.output_factor, most)};
}

// `LossWeights` at a share of the schedule: late values on the surface count more.
function lossAt(share, isFirst, loss) {
    if (isFirst) return loss.first_level;
    return {...loss.residual, value: loss.residual.value * (share >= loss.late ? loss.late_value : 1)};
}

// Measures the last level: half-width delta (Eq. 5), largest gradient, mean |f| and mean angle in degrees.
async function measured(team, levels, measuring, seed) {
    const count = Math.ceil((measuring.points + measuring.band_points) / team.workers.length);
    const parts = await team.all("measure", (k) => (
        {levels: levels.map(asQuestion), count, seed: -1 - seed - k, worker: k, team: team.workers.length}));
    const sum = (key) => parts.reduce((total, part) => total + part[key], 0);
    const most = (key) => Math.max(...parts.map((part) => part[key]));
    return {
        delta: 1.3 * Math.max(most("largest"), 1e-6), lipschitz: most("steepest"),
        meanF: sum("f") / sum("count"), angle: sum("angle") / sum("count") * 180 / Math.PI,
    };
}
