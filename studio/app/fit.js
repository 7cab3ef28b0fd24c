import {Adam, schedule} from "./optimizer.js";
import {TrainingError} from "./training_error.js";

// The optimization of one network (trainer/networks/fit.py): steps along a schedule, and restarts after a divergence.
const RESTARTS = 3, SLOWER = 3, WINDOW = 50, TERMS = ["value", "normal", "distance", "eikonal"];

// Trains the network of a task that the team has begun.
// task: {start, loss, rate, outputFactor, outputs}: start returns the first weights; loss returns the factors of the
// loss at a share of the schedule; outputs is the number of the output layer's weights.
// clock: returns the finished share of the schedule after a number of steps, in [0, 1].
// afterStep: called with {steps, share, loss, terms, weights}; may return a promise; "stop" ends the training.
// Returns {weights, steps, loss, isStopped, restarts}.
export async function fit(team, task, clock, afterStep) {
    for (let restarts = 0; restarts <= RESTARTS; ++restarts) {
        const outcome = await attempt(team, task, task.rate / SLOWER ** restarts, clock, afterStep);
        if (outcome) return {...outcome, restarts};
    }
    throw new TrainingError("the training diverges; try other levels or frequencies");
}

// Returns null where the training diverges.
async function attempt(team, task, rate, clock, afterStep) {
    const weights = task.start(), adam = new Adam(weights, task.outputs, rate, task.outputFactor);
    let steps = 0, mean = 0, isStopped = false;
    for (let share = clock(0); share < 1 && !isStopped; share = clock(steps)) {
        const factors = task.loss(share), answers = await team.all("step", () => ({weights, loss: factors}));
        const terms = TERMS.map((_, k) => answers.reduce((sum, answer) => sum + answer.terms[k], 0));
        const loss = TERMS.reduce((sum, name, k) => sum + factors[name] * terms[k], 0);
        if (!Number.isFinite(loss)) return null;
        adam.step(answers.map(({gradient}) => gradient), schedule(share));
        ++steps;
        mean += Math.max(1 / WINDOW, 1 / steps) * (loss - mean);
        isStopped = await afterStep({steps, share, loss: mean, terms, weights}) === "stop";
    }
    return {weights, steps, loss: mean, isStopped};
}
