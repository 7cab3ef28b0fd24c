import {layersOf} from "../kernel/layers.js";
import {DEFAULT_STEP_BOUND, FIRST_ITERATIONS, ITERATIONS} from "../model/constants.js";
import {turned} from "../model/orientation.js";

// Returns the model of a training in the form of parseModel (safetensors.js). shape: {name, up, front}, as of modelFile.
// trained: {levels, texture} of trainShape, or networks of this moment.
export function trainedModel({name, up = "y", front = null}, {levels, texture = null}) {
    const upright = (network) =>
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

// Returns the bytes of the file. shape: {name, center, scale, up, front}: input space = model space * scale + center
// before the turn to y up; front: as parseModel, or null. trained: of trainShape. provenance: a JSON object.
export function modelFile(shape, trained, provenance) {
    const header = {}, parts = [], {name, center, scale, up = "y", front = null} = shape;
    const {levels, texture} = trainedModel(shape, trained);
    let end = 0;
    const add = (key, size, values) => {
        header[key] = {dtype: "F32", shape: size, data_offsets: [end, end += 4 * values.length]};
        parts.push(values);
    };
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
