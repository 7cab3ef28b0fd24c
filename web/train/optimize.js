import {TrainingError} from "../kernel/training_error.js";
import {IDLE, RESTARTS, SLOWER, WATCH_FROM, WINDOW} from "../model/constants.js";
import {Optimizer, schedule} from "./optimizer.js";

// The optimization of one network (trainer/networks/fit.py): steps along a schedule, and restarts after a divergence or
// a collapse, where the network is no better than none.

// Trains the network of a task that the team has begun.
// task: {network, layout, start, factors, rate, outputFactor, outputs, rounded, kernel}: start returns the first weights;
// factors returns those of the loss at a share of the schedule; outputs is the number of the output layer's weights;
// rounded returns the weights that a step sees; kernel has the exports of an instance for the optimizer alone.
// timer: returns the finished share of the schedule after a number of steps, in [0, 1].
// afterStep: called with {steps, share, loss, meanF, weights}, means of the last steps; may return a promise. "stop" ends
// the training; "changed" says that samples or factors are new, so that losses before and after do not compare.
// Returns {weights, steps, share, loss, isStopped, restarts}. Throws TrainingError where the network learns nothing.
export async function fit(team, task, timer, afterStep) {
    for (let restarts = 0; restarts <= RESTARTS; ++restarts) {
        const outcome = await attempt(team, task, task.rate / SLOWER ** restarts, timer, afterStep);
        if (outcome) return {...outcome, restarts};
    }
    throw new TrainingError("the training learns nothing of the shape; try other levels or frequencies");
}

async function lossOf(team, weights, factors) {
    const answers = await team.all("step", () => ({weights, factors}));
    const sum = (key) => answers.reduce((total, answer) => total + answer[key], 0);
    return {loss: sum("loss"), meanF: sum("meanF"), gradients: answers.map(({gradient}) => gradient)};
}

// Returns null where the training diverges or collapses.
async function attempt(team, task, rate, timer, afterStep) {
    const weights = task.start(), optimizer = new Optimizer(weights, task, rate);
    let steps = 0, watched = 0, mean = 0, f = 0, idle = null, answer = "changed", share = timer(0);
    while (share < 1 && answer !== "stop") {
        if (answer === "changed") {
            idle = await lossOf(team, new Float32Array(weights.length), task.factors(share)); // without the network
            watched = 0;
        }
        const seen = task.rounded(weights), {loss, meanF, gradients} = await lossOf(team, seen, task.factors(share));
        if (!Number.isFinite(loss)) return null;
        optimizer.step(gradients, schedule(share));
        ++steps;
        if (share >= WATCH_FROM) ++watched;
        mean += Math.max(1 / WINDOW, 1 / Math.max(1, watched)) * (loss - mean);
        f += Math.max(1 / WINDOW, 1 / steps) * (meanF - f);
        if (watched >= WINDOW && mean > IDLE * idle.loss) return null;
        answer = await afterStep({steps, share, loss: mean, meanF: f, weights});
        if (answer !== "stop") share = timer(steps);
    }
    return {weights: task.rounded(weights), steps, share, loss: mean, isStopped: answer === "stop"};
}
