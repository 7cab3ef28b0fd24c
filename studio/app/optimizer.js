// Adam (Kingma and Ba 2015) as in trainer/networks/optimizer.py, with a rate of its own for the output layer.
const MEAN = 0.9, VARIANCE = 0.99, EPSILON = 1e-12;

export class Adam {
    // outputs: number of the last weights that belong to the output layer; outputFactor: factor on their rate.
    constructor(weights, outputs, rate, outputFactor) {
        Object.assign(this, {weights, outputs, rate, outputFactor, steps: 0});
        this.means = new Float32Array(weights.length);
        this.squares = new Float32Array(weights.length);
    }

    // Takes a step with `factor` times the rates. gradients: arrays whose sum is the gradient.
    step(gradients, factor) {
        const {weights, means, squares} = this, first = weights.length - this.outputs;
        ++this.steps;
        const bias = 1 - MEAN ** this.steps, root = Math.sqrt(1 - VARIANCE ** this.steps);
        for (let i = 0; i < weights.length; ++i) {
            let g = 0;
            for (const gradient of gradients) g += gradient[i];
            means[i] += (1 - MEAN) * (g - means[i]);
            squares[i] += (1 - VARIANCE) * (g * g - squares[i]);
            const rate = factor * this.rate * (i < first ? 1 : this.outputFactor);
            weights[i] -= rate / bias * means[i] / (Math.sqrt(squares[i]) / root + EPSILON);
        }
    }
}

// Returns the factor on the learning rate at a share of the schedule (trainer/networks/fit.py).
export function schedule(share, warmUp = 0.05) {
    return share < warmUp ? share / warmUp : 0.5 + 0.5 * Math.cos(Math.PI * (share - warmUp) / (1 - warmUp));
}
