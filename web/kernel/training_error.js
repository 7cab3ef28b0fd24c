/** An error of a training with a one-line message for the visitor: a shape, or settings, that cannot be learnt. */
export class TrainingError extends Error {}
