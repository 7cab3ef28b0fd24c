import {layersOf} from "../kernel/layers.js";
import {DEFAULT_STEP_BOUND, FIRST_ITERATIONS, ITERATIONS} from "../model/constants.js";
import {turned} from "../model/orientation.js";
/** @import {KernelWeights} from "../kernel/layers.js" */
/** @import {FileShape} from "../stage/state.js" */

/** Returns the model of a training. @param {Pick<FileShape, "name" | "up" | "front">} shape
 * @param {Moment} trained @returns {Model} */
export function trainedModel({name, up = "y", front = null}, {levels, texture = null}) {
    const upright = (/** @type {KernelWeights} */ network) =>
        layersOf(network).map((layer, j) => (
            j ? layer : {...layer, weight: turned(layer.weight, up)}
        ));
    const networks = levels.map(upright), colors = texture && upright(texture), bound = DEFAULT_STEP_BOUND;
    const sizes = [...networks, ...(colors ? [colors] : [])].flat().map(({weight, bias}) =>
        weight.length + bias.length
    );
    return {
        name,
        inputs: "xyz",
        front,
        credit: "",
        texture: colors,
        parameters: sizes.reduce((sum, size) => sum + size, 0),
        levels: levels.map(({delta, stepBound = bound, bandStepBound = bound}, i) => ({
            network: networks[i],
            delta,
            iterations: i ? ITERATIONS : FIRST_ITERATIONS,
            bounds: {step_bound: stepBound, band_step_bound: bandStepBound},
        })),
    };
}

// Writes a model file (docs/format.md).
/** A training's networks of this moment. @typedef {{
 *     levels: (KernelWeights & {delta: number, stepBound?: number, bandStepBound?: number})[],
 *     texture?: KernelWeights | null}} Moment */

/** Returns the bytes of the file. shape: before the turn to y up.
 * @param {FileShape} shape @param {Trained} trained @param {object} provenance */
export function modelFile(shape, trained, provenance) {
    const header = /** @type {Record<string, object>} */ ({}), parts = /** @type {Float32Array[]} */ ([]);
    const {name, center, scale, up = "y", front = null} = shape;
    const {levels, texture} = trainedModel(shape, trained);
    let end = 0;
    /** @param {string} key @param {number[]} size @param {Float32Array} values */
    const add = (key, size, values) => {
        header[key] = {dtype: "F32", shape: size, data_offsets: [end, end += 4 * values.length]};
        parts.push(values);
    };
    /** @param {string} key @param {Network} network */
    const addNetwork = (key, network) =>
        network.forEach(({rows, columns, weight, bias}, j) => {
            add(`${key}.layer${j}.weight`, [rows, columns], weight);
            add(`${key}.layer${j}.bias`, [rows], bias);
        });
    levels.forEach(({network}, i) => addNetwork(`level${i + 1}`, network));
    if (texture) addNetwork("texture", texture);
    const model = {
        name,
        inputs: "xyz",
        centre: turned(center, up),
        scale,
        ...(up === "y" ? {} : {up}),
        ...(front ? {front} : {}),
        provenance,
        levels: levels.map(({delta, iterations, bounds}, i) => ({
            delta,
            lipschitz: trained.levels[i].lipschitz,
            iterations,
            ...bounds,
        })),
    };
    header.__metadata__ = {format: "mplicits", version: "1", model: JSON.stringify(model)};
    const text = new TextEncoder().encode(JSON.stringify(header)), start = 8 + 8 * Math.ceil(text.length / 8);
    const file = new Uint8Array(start + end).fill(32, 8, start); // safetensors pads with spaces
    new DataView(file.buffer).setBigUint64(0, BigInt(start - 8), true);
    file.set(text, 8);
    let at = start;
    for (const values of parts) {
        file.set(new Uint8Array(values.buffer, values.byteOffset, values.byteLength), at);
        at += values.byteLength;
    }
    return file;
}
