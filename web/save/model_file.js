import {layersOf} from "../kernel/layers.js";
import {FIRST_ITERATIONS, ITERATIONS} from "../model/constants.js";
import {turned} from "../model/orientation.js";

// Writes a model file (docs/format.md).

// Returns the bytes of the file. shape: {name, center, scale, up, front}: input space = model space * scale + center
// before the turn to y up; front: as parseModel, or null. trained: of trainShape. provenance: a JSON object.
export function modelFile({name, center, scale, up = "y", front = null}, {levels, texture = null}, provenance) {
    const header = {}, parts = [];
    let end = 0;
    const add = (key, shape, values) => {
        header[key] = {dtype: "F32", shape, data_offsets: [end, end += 4 * values.length]};
        parts.push(values);
    };
    const addNetwork = (key, network) => layersOf(network).forEach(({rows, columns, weight, bias}, j) => {
        add(`${key}.layer${j}.weight`, [rows, columns], j ? weight : turned(weight, up));
        add(`${key}.layer${j}.bias`, [rows], bias);
    });
    levels.forEach((level, i) => addNetwork(`level${i + 1}`, level));
    if (texture) addNetwork("texture", texture);
    const model = {
        name, inputs: "xyz", centre: turned(center, up), scale, ...(up === "y" ? {} : {up}), ...(front ? {front} : {}), provenance,
        levels: levels.map(({delta, lipschitz, stepBound, bandStepBound}, i) => ({
            delta, lipschitz, iterations: i ? ITERATIONS : FIRST_ITERATIONS,
            step_bound: stepBound, band_step_bound: bandStepBound, // JSON leaves out what is undefined
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
