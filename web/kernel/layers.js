import {INPUTS} from "./kernel.js";

/** A network in the kernel's order; layout: without padding.
 * @typedef {Pick<TrainedNetwork, "network" | "layout" | "weights">} KernelWeights */

/** Returns a network's layers, without the padding and the time of the kernel's weights.
 * @param {KernelWeights} network @returns {Network} */
export function layersOf({network, layout, weights}) {
    return placesOf(network, layout).map(({rows, columns, stride, at, biases}) => {
        const weight = new Float32Array(rows * columns);
        for (let o = 0; o < rows; ++o)
            weight.set(weights.subarray(at + o * stride, at + o * stride + columns), o * columns);
        return {rows, columns, weight, bias: weights.slice(biases, biases + rows)};
    });
}

/** Writes layers into weights in the kernel's order, and returns them.
 * @param {Network} layers @param {Float32Array} weights @param {KernelNetwork} network @param {Layout} layout */
export function putLayers(layers, weights, network, layout) {
    placesOf(network, layout).forEach(({rows, columns, stride, at, biases}, j) => {
        const {weight, bias} = layers[j];
        for (let o = 0; o < rows; ++o) weights.set(weight.subarray(o * columns, (o + 1) * columns), at + o * stride);
        weights.set(bias, biases);
    });
    return weights;
}

/** Returns where the layers are. stride: floats from row to row; at, biases: first floats.
 * @param {KernelNetwork} network @param {Layout} layout */
function placesOf({width, depth, outputs}, layout) {
    /** @type {Record<"rows" | "columns" | "stride" | "at" | "biases", number>[]} */
    const places = [];
    let at = 0;
    /** @param {number} paddedRows @param {number} stride @param {number} rows @param {number} columns */
    const add = (paddedRows, stride, rows, columns) => {
        const biases = at + paddedRows * stride;
        places.push({rows, columns, stride, at, biases});
        at = biases + paddedRows;
    };
    add(width, INPUTS, layout.width, 3);
    for (let j = 0; j < depth; ++j) add(width, width, layout.width, layout.width);
    add(outputs, width, outputs, layout.width);
    return places;
}
