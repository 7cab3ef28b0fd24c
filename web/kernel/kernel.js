// The numbers that a network has in the kernel (kernel/siren.c).
export const INPUTS = 4, TILE = 64, SAMPLE = 12, RESULT = 4; // floats of a sample, of a result
export const VALUE = 4, GRADIENT = 5, DISTANCE = 8, NORMAL = 9; // first columns of a sample's entries
export const DIRECTION = 4, COLOR = 8; // of a texture's sample
export const FACTORS = ["value", "normal", "distance", "eikonal", "length", "excess", "lacking", "near"];

/** Returns the number of parameters of a network in the kernel's order (siren.c). @param {KernelNetwork} network */
export function parameterCount({width, depth, outputs}) {
    return (INPUTS + 1) * width + depth * (width + 1) * width + outputs * (width + 1);
}
