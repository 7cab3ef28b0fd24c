// How the time of a training is shared out among its stages: the levels, then the texture (trainer/plan.py).
// Steps. At Tiny, the bunny is shards after 20, has loose pieces after 100, and is smooth after 300: then it is 1.2 times as
// far off as after 600.
const LEAST_LEVEL = 300, LEAST_TEXTURE = 100;

/** Returns the cost of each stage, relative to the others. Level 1 gets the time of the largest network, because its
 * errors far from the surface cost every residual.
 * @param {Settings} settings @param {Config["budget"]} budget @param {boolean} hasTexture */
export function stageCosts({levels, texture, steps}, budget, hasTexture) {
    const networks = hasTexture ? [...levels, texture] : levels;
    if (steps) return networks.map((network, i) => steps[i] * stepCost(network));
    const roots = levels.map((network) => Math.sqrt(stepCost(network)));
    const costs = roots.map((root, i) => (i ? budget.residual * root : Math.max(...roots)));
    return hasTexture ? [...costs, budget.texture * Math.max(...costs)] : costs;
}

/** Estimates the cost of a step by the network's number of weights. @param {Layout} network */
export function stepCost({width, depth}) {
    return width * 4 + width * width * depth;
}

/** Returns the steps that a stage takes where `first` of it is done: exactly so many, or at least so many where stages
 * have a time. @param {Settings} settings @param {number} i of the stage */
export function leastSteps({levels, steps}, i, first = 0) {
    return Math.max(1, Math.round((1 - first) * (steps ? steps[i] : i < levels.length ? LEAST_LEVEL : LEAST_TEXTURE)));
}

/** Returns a function from the steps of a stage to its finished share, from `first` to 1. @param {number} first
 * @param {number} least fewest steps @param {() => number} clock
 * @param {number} end of the stage, as of the clock; 0 for `least` steps */
export function timer(first, least, clock, end) {
    const start = clock();
    const passed = () => (end > start ? (clock() - start) / (end - start) : 1);
    return (/** @type {number} */ steps) => Math.min(1, first + (1 - first) * Math.min(steps / least, passed()));
}
