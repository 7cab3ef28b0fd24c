import {TrainingError} from "../kernel/training_error.js";
import {IDLE, RESTARTS, SLOWER, WATCH_FROM, WINDOW} from "../model/constants.js";
import {Optimizer, schedule} from "./optimizer.js";
/** @import {KernelExports} from "../kernel/kernel_instance.js" */

// The optimization of one network (trainer/networks/fit.py): steps along a schedule, and restarts after a divergence or
// a collapse, where the network is no better than none.

/** A step. factors: `LossWeights` of a level, or {smoothness}; gradient, loss: shares of the sums over all answers;
 * meanF: of |f| on the surface.
 * @typedef {{weights: Float32Array, factors: Record<string, number>}} StepQuestion
 * @typedef {{gradient: Float32Array, loss: number, meanF: number}} StepAnswer
 * @typedef {{all: (name: "step", question: () => StepQuestion) => Promise<StepAnswer[]>}} Stepper */
/** A network to train. start: its first weights; factors: of the loss at a share of the schedule; outputs: weights of
 * the output layer; rounded: the weights that a step sees; kernel: an instance for the optimizer alone.
 * @typedef {{network: KernelNetwork, layout: Layout, start: () => Float32Array,
 *     factors: (share: number) => Record<string, number>, rate: number, outputFactor: number, outputs: number,
 *     rounded: (weights: Float32Array) => Float32Array, kernel: KernelExports}} Task */
/** Means of the last steps. share: of the schedule.
 * @typedef {{steps: number, share: number, loss: number, meanF: number, weights: Float32Array}} State */
/** "stop" ends the training; "changed" says that samples or factors are new, so that losses before and after do not
 * compare. @typedef {(state: State) => string | boolean | Promise<string | boolean>} AfterStep */

/** Trains the network of a task that the team has begun. Throws TrainingError where the network learns nothing.
 * @param {Stepper} team @param {Task} task
 * @param {(steps: number) => number} timer returns the finished share of the schedule, in [0, 1]
 * @param {AfterStep} afterStep */
export async function fit(team, task, timer, afterStep) {
    for (let restarts = 0; restarts <= RESTARTS; ++restarts) {
        const outcome = await attempt(team, task, task.rate / SLOWER ** restarts, timer, afterStep);
        if (outcome) return {...outcome, restarts};
    }
    throw new TrainingError("the training learns nothing of the shape; try other levels or frequencies");
}

/** @param {Stepper} team @param {Float32Array} weights @param {Record<string, number>} factors */
async function lossOf(team, weights, factors) {
    const answers = await team.all("step", () => ({weights, factors}));
    const sum = (/** @type {"loss" | "meanF"} */ key) => answers.reduce((total, answer) => total + answer[key], 0);
    return {loss: sum("loss"), meanF: sum("meanF"), gradients: answers.map(({gradient}) => gradient)};
}

/** Returns null where the training diverges or collapses. @param {Stepper} team @param {Task} task @param {number} rate
 * @param {(steps: number) => number} timer @param {AfterStep} afterStep */
async function attempt(team, task, rate, timer, afterStep) {
    const weights = task.start(), optimizer = new Optimizer(weights, task, rate);
    let steps = 0, watched = 0, mean = 0, f = 0, idle = 0, share = timer(0);
    /** @type {string | boolean} */
    let answer = "changed";
    while (share < 1 && answer !== "stop") {
        if (answer === "changed") {
            const none = new Float32Array(weights.length); // without the network
            idle = (await lossOf(team, none, task.factors(share))).loss;
            watched = 0;
        }
        const seen = task.rounded(weights), {loss, meanF, gradients} = await lossOf(team, seen, task.factors(share));
        if (!Number.isFinite(loss)) return null;
        optimizer.step(gradients, schedule(share));
        ++steps;
        if (share >= WATCH_FROM) ++watched;
        mean += Math.max(1 / WINDOW, 1 / Math.max(1, watched)) * (loss - mean);
        f += Math.max(1 / WINDOW, 1 / steps) * (meanF - f);
        if (watched >= WINDOW && mean > IDLE * idle) return null;
        answer = await afterStep({steps, share, loss: mean, meanF: f, weights});
        if (answer !== "stop") share = timer(steps);
    }
    return {weights: task.rounded(weights), steps, share, loss: mean, isStopped: answer === "stop"};
}
