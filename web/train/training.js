import {INPUTS, parameterCount, TILE} from "../kernel/kernel.js";
import {layersOf, putLayers} from "../kernel/layers.js";
import {randomNumbers} from "../kernel/random.js";
import {DELTA_FACTOR, FIRST_GRAY, SEEDS} from "../model/constants.js";
import {clampToQuantized, quantized} from "../model/quantize.js";
import {stepperOf} from "./gpu_steps.js";
import {fit} from "./optimize.js";
import {leastSteps, stageCosts, stepCost, timer} from "./plan.js";
/** @import {KernelExports} from "../kernel/kernel_instance.js" */
/** @import {BareLevel} from "./nested.js" */
/** @import {State, Task} from "./optimize.js" */
/** @import {Team} from "./workers.js" */

// The training of a shape: level after level, each frozen before the next begins, then the texture (trainer/train.py).
const TIMED = 4096; // points of a measurement that is timed
const LEAST_SHARE = 0.4; // of a stage's seconds, that remains for its steps after the preparation
const STEADY = 20; // steps after which their mean time says how fast the device is

/** Draws the weights of a new network, in the kernel's order (`initial` of trainer/networks/network.py). The weights of
 * the time and of padding neurons are zero. @param {Layout} layout @param {number} padded width with padding
 * @param {number} outputs @param {number} omega @param {number} outputFactor @param {() => number} random */
export function initialWeights({width, depth}, padded, outputs, omega, outputFactor, random) {
    const weights = new Float32Array(parameterCount({width: padded, depth, outputs}));
    const uniform = (/** @type {number} */ bound) => (2 * random() - 1) * bound, bound = Math.sqrt(6 / width);
    let at = INPUTS * padded;
    for (let o = 0; o < width; ++o) {
        for (let k = 0; k < 3; ++k) weights[INPUTS * o + k] = uniform(omega / 3);
        weights[at + o] = uniform(Math.PI);
    }
    at += padded;
    for (let j = 0; j < depth; ++j, at += (padded + 1) * padded) {
        for (let o = 0; o < width; ++o) for (let k = 0; k < width; ++k) weights[at + o * padded + k] = uniform(bound);
    }
    for (let c = 0; c < outputs; ++c, at += padded) {
        for (let k = 0; k < width; ++k) weights[at + k] = uniform(bound / omega * outputFactor);
    }
    return weights;
}

/** Networks of an earlier training: finished levels, and the weights of the next one at a share of its schedule.
 * @typedef {Trained & {weights: Float32Array | null, share: number}} Start */
/** A step. share: of the stage; done: of the whole; least: fewest steps of the stage; isLate: whether its time is over;
 * left: seconds to the end of the whole.
 * @typedef {State & {stage: number, done: number, levels: TrainedLevel[], network: KernelNetwork, layout: Layout,
 *     least: number, isLate: boolean, left: number}} TrainingStep */
/** module: the compiled kernel; hasColors: whether to train a texture; gpu: text of the WebGPU kernel; clock: returns
 * the seconds of the training so far, without pauses; end: of the training, as of the clock; afterStep: "stop" ends the
 * training; tell: called with a stage, and what is done before or after its steps.
 * @typedef {{module: WebAssembly.Module, hasColors?: boolean, gpu?: string, clock: () => number, end: number,
 *     start: Start | null, afterStep: (step: TrainingStep) => Promise<string> | string,
 *     tell?: (stage: number, doing: string) => void}} TrainingOptions */
/** part: a worker's samples on the surface in a step, as many as off it.
 * @typedef {Omit<Task, "kernel"> & {part: number}} Stage */

/** Trains the networks of a shape that the team has loaded.
 * @param {Team} team @param {Settings} settings @param {Config} config @param {TrainingOptions} options */
export async function trainShape(
    team,
    settings,
    config,
    {module, hasColors = false, gpu, clock, end, start, afterStep, tell},
) {
    const kernel = /** @type {KernelExports} */ ((await WebAssembly.instantiate(module)).exports);
    /** @type {Trained} */
    const trained = {levels: [...start?.levels ?? []], texture: start?.texture ?? null};
    const withTexture = hasColors && !trained.texture, costs = stageCosts(settings, config.budget, withTexture);
    const sum = (/** @type {number[]} */ numbers) => numbers.reduce((total, number) => total + number, 0);
    const networks = [...settings.levels, settings.texture];
    let resumed = start?.weights, first = start?.share ?? 0;
    for (let i = trained.levels.length; i < costs.length; ++i) {
        tell?.(i, "preparing");
        const began = clock(), left = sum(costs.slice(i)) - first * costs[i];
        const due = began + (end - began) * (1 - first) * costs[i] / left, isTexture = i === settings.levels.length;
        const reserve = settings.steps || isTexture ? 0 : await measuringTime(team, settings, config, trained.levels);
        const prepare = isTexture ? textureStage : levelStage;
        const stage = await prepare(team, settings, config, trained.levels, due - began);
        const earlier = resumed;
        if (earlier) stage.start = () => earlier.slice();
        const soonest = clock() + LEAST_SHARE * (due - began);
        const stageEnd = settings.steps ? 0 : Math.max(due - reserve, soonest);
        const least = leastSteps(settings, i, first), time = timer(first, least, clock, stageEnd), ready = clock();
        const secondsLeft = (/** @type {number} */ steps) => {
            const now = clock(), each = steps < STEADY ? 0 : (now - ready) / steps;
            const later = costs.map((_, k) => (k <= i ? 0 : ready - began + reserve
                + leastSteps(settings, k) * each * stepCost(networks[k]) / stepCost(networks[i]))
            );
            return Math.max(end - now, Math.max(stageEnd - now, (least - steps) * each) + reserve + sum(later));
        };
        const stepper = await stepperOf(team, gpu, stage.network, stage.part, settings.isOnGpu);
        const mine = isTexture ? () => false : miner(team, stage, config, () => (stageEnd || Infinity) - clock());
        const outcome = await fit(stepper, {...stage, kernel}, time, async (state) => {
            const isMined = await mine(state);
            return await afterStep({
                ...state,
                stage: i,
                done: (sum(costs.slice(0, i)) + costs[i] * state.share) / sum(costs),
                levels: trained.levels,
                network: stage.network,
                layout: stage.layout,
                least,
                isLate: stageEnd > 0 && clock() > stageEnd,
                left: secondsLeft(state.steps),
            }) || (isMined && "changed");
        }).finally(stepper.end);
        const {weights, steps, share, loss, restarts} = outcome;
        const network = {network: stage.network, layout: stage.layout, weights, steps, share, loss, restarts};
        if (isTexture) {
            trained.texture = {...network, seconds: clock() - began};
        } else {
            trained.levels.push(/** @type {TrainedLevel} */ (network));
            tell?.(i, "measuring");
            await measured(team, trained.levels, config.measuring, settings.seed);
            trained.levels[i].seconds = clock() - began;
        }
        if (outcome.isStopped) break;
        resumed = undefined;
        first = 0;
    }
    return trained;
}

/** Prepares the team for the level after finished ones. @param {Team} team @param {Settings} settings
 * @param {Config} config @param {TrainedLevel[]} levels @param {number} seconds @returns {Promise<Stage>} */
async function levelStage(team, settings, config, levels, seconds) {
    const i = levels.length, layout = settings.levels[i], network = paddedNetwork(layout, 1);
    const {seed, part} = await begun(team, "begin", settings, config, levels, network, i, seconds, {});
    const delta = i ? levels[i - 1].delta : null, random = randomNumbers(seed);
    const {rate, outputFactor} = rates(layout.width, delta, config.step);
    const outputs = i ? config.step.residual_output : 1;
    return {
        network,
        layout,
        part,
        rate,
        outputFactor,
        outputs: network.width + 1,
        rounded: roundedBy(settings, network, layout),
        start: () => initialWeights(layout, network.width, 1, settings.omegas[i], outputs, random),
        factors: (share) => lossAt(share, i === 0, config.loss),
    };
}

/** Returns a function to call after each step of a level: at shares of its schedule, the team mines hard samples,
 * unless that takes too much of the time left (trainer/callbacks.py). Returns whether it is such a share, at which the
 * loss's factors may change, too. @param {Team} team @param {Stage} stage @param {Config} config
 * @param {() => number} left returns the level's remaining seconds */
function miner(team, {factors}, {sampling, mining}, left) {
    let passed = 0, spent = 0;
    return async (/** @type {State} */ {share, weights}) => {
        const due = mining.schedule.filter((at) => at <= share).length, isDue = due > passed;
        passed = due;
        if (!isDue || spent > mining.longest * left()) return isDue;
        const began = performance.now();
        await team.all("mine", () => ({weights, factors: factors(share), config: {sampling, mining}}));
        spent = (performance.now() - began) / 1000;
        return true;
    };
}

/** @param {Team} team @param {Settings} settings @param {Config} config @param {TrainedLevel[]} levels
 * @param {number} seconds @returns {Promise<Stage>} */
async function textureStage(team, settings, config, levels, seconds) {
    const {texture: {rate, output_factor, smoothness, colors_per_sample}} = config, layout = settings.texture;
    const network = paddedNetwork(layout, 3), more = {colors: colors_per_sample};
    const {seed, part} = await begun(team, "beginTexture", settings, config, levels, network, SEEDS - 1, seconds, more);
    const random = randomNumbers(seed), outputs = 3 * (network.width + 1);
    return {
        network,
        layout,
        part,
        rate,
        outputFactor: output_factor,
        outputs,
        rounded: roundedBy(settings, network, layout),
        start: () => {
            const weights = initialWeights(layout, network.width, 3, settings.omegas[levels.length], 1, random);
            return weights.fill(FIRST_GRAY, weights.length - 3);
        },
        factors: () => ({smoothness}),
    };
}

/** Returns the kernel's network of a layout. @type {(layout: Layout, outputs: number) => KernelNetwork} */
export const paddedNetwork = ({width, depth}, outputs) => ({width: 4 * Math.ceil(width / 4), depth, outputs});

/** Asks the team to draw the samples of a stage. Returns its seed and `part`. @param {Team} team
 * @param {"begin" | "beginTexture"} question @param {Settings} settings @param {Config} config
 * @param {TrainedLevel[]} levels @param {KernelNetwork} network @param {number} index of the seed
 * @param {number} seconds @param {{colors?: number}} more */
async function begun(team, question, settings, config, levels, network, index, seconds, more) {
    const {sampling, step} = config, size = team.workers.length, seed = settings.seed * SEEDS + index;
    const {smallest_pool: least, largest_pool: most, pool_per_step: each, pool_per_second: rate} = sampling;
    const fewest = leastSteps(settings, Math.min(index, settings.levels.length)) * each;
    const samples = settings.steps ? fewest : Math.max(seconds * rate, fewest);
    const pool = Math.ceil(Math.min(Math.max(samples, least), most) / size);
    const part = TILE * Math.max(1, Math.round(Math.min(step.batch / 2 / size, pool) / TILE));
    await team.all(question, (k) => ({
        network,
        levels: levels.map(asQuestion),
        pool,
        on: part,
        around: part,
        team: size,
        seed: seed * size + k,
        config: sampling,
        ...more,
    }));
    return {seed, part};
}

/** Returns what the workers need of a level. @param {BareLevel} level @returns {BareLevel} */
export function asQuestion({network, weights, delta}) {
    return {network, weights, delta};
}

/** Returns the function `rounded` of a task: with packed settings, it quantizes (trainer/networks/quantized.py).
 * @param {Settings} settings @param {KernelNetwork} network @param {Layout} layout @returns {Task["rounded"]} */
function roundedBy({packed}, network, layout) {
    if (!packed) return (weights) => weights;
    return (weights) => {
        const own = layersOf({network, layout, weights}), near = quantized(own);
        clampToQuantized(own, near);
        putLayers(own, weights, network, layout);
        return putLayers(near, weights.slice(), network, layout);
    };
}

/** `rates` of trainer/level.py. @param {number} width @param {number | null} delta @param {Config["step"]} step */
function rates(width, delta, step) {
    const most = delta === null ? Infinity : step.output_factor_per_delta * delta;
    return {rate: step.rate * Math.min(1, step.rate_width / width), outputFactor: Math.min(step.output_factor, most)};
}

/** `LossWeights` at a share of the schedule: late values on the surface count more.
 * @param {number} share @param {boolean} isFirst @param {Config["loss"]} loss */
function lossAt(share, isFirst, loss) {
    if (isFirst) return loss.first_level;
    return {...loss.residual, value: loss.residual.value * (share >= loss.late ? loss.late_value : 1)};
}

/** Measures the last level: half-width delta (Eq. 5), largest gradient, mean |f|, mean distance of the shape's surface
 * to the model's, mean angle in degrees, and its step bound; lowers the bounds of the levels before as bands.
 * @param {Team} team @param {TrainedLevel[]} levels @param {Config["measuring"]} config @param {number} seed */
async function measured(team, levels, {points, band_points: more, tracing}, seed) {
    const count = Math.ceil((points + more) / team.workers.length), size = team.workers.length;
    const parts = await team.all("measure", (k) => (
        {levels: levels.map(asQuestion), count, seed: -1 - seed - k, worker: k, team: size}
    ));
    const sum = (/** @type {keyof parts[number]} */ key) => parts.reduce((total, part) => total + part[key], 0);
    /** @template {string} K @param {Record<K, number>[]} of @param {K} key */
    const most = (of, key) => Math.max(...of.map((part) => part[key]));
    const level = levels[levels.length - 1], delta = DELTA_FACTOR * Math.max(most(parts, "largest"), 1e-6);
    level.delta = delta;
    const rays = await team.all("trace", (k) => (
        {levels: levels.map(asQuestion), seed: -1 - seed - k, team: size, config: tracing}
    ));
    const bounds = levels.map((_, i) => Math.min(...rays.map((part) => part.bounds[i])));
    levels.slice(0, -1).forEach((band, i) => {
        band.bandStepBound = Math.min(band.bandStepBound, bounds[i]);
    });
    Object.assign(level, {
        lipschitz: Math.max(most(parts, "steepest"), most(rays, "steepest")),
        stepBound: bounds[bounds.length - 1],
        bandStepBound: 1,
        meanF: sum("f") / sum("count"),
        distance: sum("distance") / sum("count"),
        angle: sum("angle") / sum("count") * 180 / Math.PI,
    });
}

/** Estimates the seconds of measured() after the next level.
 * @param {Team} team @param {Settings} settings @param {Config} config @param {TrainedLevel[]} levels */
async function measuringTime(team, settings, {measuring}, levels) {
    const network = paddedNetwork(settings.levels[levels.length], 1),
        weights = new Float32Array(parameterCount(network));
    const asked = [...levels, {network, weights, delta: 1}].map(asQuestion);
    const measure = () => team.all("measure", () => ({levels: asked, count: TIMED, seed: 0, worker: null, team: 1}));
    await measure(); // the first run is slow
    const began = performance.now();
    await measure();
    const {rays, rounds, worst, expected_samples: samples} = measuring.tracing;
    const points = measuring.points + measuring.band_points +
        (2 * rays + rounds * worst * (levels.length + 1)) * samples;
    return (performance.now() - began) / 1000 * points / TIMED / team.workers.length;
}
