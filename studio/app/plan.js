// How the time of a training is shared out among its stages: the levels, then the texture (trainer/plan.py).
const LEAST_STEPS = 20; // of a stage that has a time, even where its preparation took it all

// Returns the cost of each stage, relative to the others. settings: see trainShape; budget: `BudgetConfig` of
// trainer/config.py; hasTexture: whether a texture is trained. Level 1 gets the time of the largest network, because its
// errors far from the surface cost every residual.
export function stageCosts({levels, texture, steps}, budget, hasTexture) {
    const networks = hasTexture ? [...levels, texture] : levels;
    if (steps) return networks.map((network, i) => steps[i] * stepCost(network));
    const roots = levels.map((network) => Math.sqrt(stepCost(network)));
    const costs = roots.map((root, i) => (i ? budget.residual * root : Math.max(...roots)));
    return hasTexture ? [...costs, budget.texture * Math.max(...costs)] : costs;
}

// Estimates the cost of a step by the network's number of weights.
function stepCost({width, depth}) {
    return width * 4 + width * width * depth;
}

// Returns a function from the steps of a stage to its finished share, from `first` to 1. end: of the stage, as of
// clock(); null for `count` steps.
export function timer(first, count, clock, end) {
    const start = clock?.();
    const done = end === null ? (steps) => steps / Math.max(1, Math.round(count * (1 - first)))
        : (steps) => Math.min(steps / LEAST_STEPS, end > start ? (clock() - start) / (end - start) : 1);
    return (steps) => Math.min(1, first + (1 - first) * done(steps));
}
