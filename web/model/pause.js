// Resolves after some milliseconds.
export const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));
