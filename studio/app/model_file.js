import {INPUTS} from "./kernel.js";
import {turned} from "./orientation.js";

// Writes a model file (docs/format.md).
const FIRST_ITERATIONS = 20, ITERATIONS = 5; // of sphere tracing, as in the paper

// Returns a network as a list of layers {rows, columns, weight, bias}, without padding and time, turned so that the axis
// `up` of the file points up. network: of trainShape (training.js).
export function layersOf({network: {width, depth, outputs}, layout, weights}, up = "y") {
    const layers = [];
    let at = 0;
    const take = (paddedRows, paddedColumns, rows, columns) => {
        const weight = new Float32Array(rows * columns), biases = at + paddedRows * paddedColumns;
        for (let o = 0; o < rows; ++o) {
            weight.set(weights.subarray(at + o * paddedColumns, at + o * paddedColumns + columns), o * columns);
        }
        layers.push({rows, columns, weight, bias: weights.slice(biases, biases + rows)});
        at = biases + paddedRows;
    };
    take(width, INPUTS, layout.width, 3);
    for (let j = 0; j < depth; ++j) take(width, width, layout.width, layout.width);
    take(outputs, width, outputs, layout.width);
    layers[0].weight = turned(layers[0].weight, up);
    return layers;
}

// Returns the bytes of the file. shape: {name, center, scale, up, front}: input space = model space * scale + center
// before the turn to y up; front: as parseModel, or null. trained: of trainShape. provenance: a JSON object.
export function modelFile({name, center, scale, up = "y", front = null}, {levels, texture = null}, provenance) {
    const header = {}, parts = [];
    let end = 0;
    const add = (key, shape, values) => {
        header[key] = {dtype: "F32", shape, data_offsets: [end, end += 4 * values.length]};
        parts.push(values);
    };
    const addNetwork = (key, network) => layersOf(network, up).forEach(({rows, columns, weight, bias}, j) => {
        add(`${key}.layer${j}.weight`, [rows, columns], weight);
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
