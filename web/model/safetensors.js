import {shared} from "./facts.js";
import {unpackWeights} from "./packed_weights.js";

// Reads a model file (docs/format.md). A ModelError has a one-line message.
export class ModelError extends Error {}

const FORMAT = shared.format, STEP_BOUNDS = FORMAT.step_bounds;
const LARGEST = 3.4028234663852886e38, SMALLEST = 1.1754943508222875e-38; // of the normal 32-bit floats

/** @typedef {{dtype: string, shape: number[], data_offsets: number[]}} Entry of a tensor in the header */
/** @typedef {{name: string, inputs: "xyz" | "xyzt", levels: Record<string, number>[], front: number[] | null,
 * credit: string, packed: Record<string, number[]>, scene?: object}} Description */

/** Throws ModelError.
 * @param {ArrayBuffer} buffer @param own whether it is the page's own model, whose weights may be short (web/weights.py)
 * @returns {Model} */
export function parseModel(buffer, own = false) {
    const header = readHeader(buffer), {__metadata__, ...entries} = header.entries, metadata = __metadata__ ?? {};
    refuse(metadata.format !== FORMAT.name, `not an ${FORMAT.name} model (metadata key 'format')`);
    refuse(!/^[1-9][0-9]{0,8}$/.test(metadata.version ?? ""), "metadata key 'version' is not a version number");
    if (Number(metadata.version) > FORMAT.version) {
        throw new ModelError(
            `format version ${metadata.version} is newer than this page reads (${FORMAT.version}); `
                + "bake a new page",
        );
    }
    const spans = Object.values(entries).map((entry) => [entry?.data_offsets].flat());
    const claimed = spans.reduce((sum, [from, to]) => sum + Math.max(to - from || 0, 0), 0);
    refuse(claimed > buffer.byteLength, "the tensors overlap: the file is damaged");
    const end = spans.sort(([a, b], [c, d]) => a - c || b - d).reduce((at, [from, to]) => (from === at ? to : NaN), 0);
    refuse(header.end + end !== buffer.byteLength, "the file is cut short or damaged");
    const description = describe(metadata.model);
    if (description.scene) {
        throw new ModelError(
            "a scene of several shapes needs a separate page; "
                + "make it with: mplicits bake SCENE.safetensors --target html",
        );
    }
    const tensors = new Map(), sizes = {F32: 4, ...(own ? {F16: 2, I16: 2, I8: 1} : {})};
    const steps = own ? JSON.parse(metadata.steps ?? "{}") : {};
    const isPacked = Number(metadata.version) === FORMAT.version;
    if (isPacked) {
        const {values} = readTensor("packed", entries.packed, buffer, header.end, {U8: 1});
        try {
            for (const [name, tensor] of unpackWeights(description.packed, /** @type {Uint8Array} */ (values)))
                tensors.set(name, tensor);
        } catch {
            throw new ModelError("packed: the file is cut short or damaged");
        }
        delete entries.packed;
    }
    for (const [name, entry] of Object.entries(entries)) {
        const ofModel = !name.startsWith(`${FORMAT.training}.`);
        refuse(ofModel && isPacked, `${name}: a tensor beside the packed ones`);
        if (!ofModel) continue;
        tensors.set(name, /** @type {Tensor} */ (readTensor(name, entry, buffer, header.end, sizes, steps[name])));
    }
    const inputs = description.inputs === "xyzt" ? 4 : 3;
    let parameters = 0;
    for (const tensor of tensors.values()) parameters += tensor.values.length;
    const levels = description.levels.map((level, i) => ({
        network: takeNetwork(tensors, `level${i + 1}`, inputs, 1),
        delta: level.delta,
        iterations: level.iterations,
        bounds: /** @type {Bounds} */ (
            Object.fromEntries(STEP_BOUNDS.map((key) => [key, level[key] ?? FORMAT.default_step_bound]))
        ),
    }));
    const texture = tensors.has("texture.layer0.weight") ? takeNetwork(tensors, "texture", inputs, 3) : null;
    if (tensors.size) {
        const extra = [...tensors.keys()].sort()[0];
        throw new ModelError(
            `${extra}: not a tensor of a model with ${levels.length} levels, `
                + "or the layer before it is missing",
        );
    }
    const {name, front, credit} = description;
    return {name, inputs: description.inputs, front, credit, levels, texture, parameters};
}

/** Returns the header's entries by tensor name, and the file offset of the tensors' bytes.
 * @param {ArrayBuffer} buffer */
function readHeader(buffer) {
    const damaged = () => new ModelError("not a model file (.safetensors), or a damaged one");
    if (buffer.byteLength < 10) throw damaged();
    const length = Number(new DataView(buffer).getBigUint64(0, true));
    if (length > buffer.byteLength - 8) throw damaged();
    let entries = null;
    try {
        entries = JSON.parse(new TextDecoder("utf-8", {fatal: true}).decode(new Uint8Array(buffer, 8, length)));
    } catch { /* entries is no object */ }
    if (!isObject(entries) || !Object.values(entries.__metadata__ ?? {}).every(isText)) throw damaged();
    return {entries, end: 8 + length};
}

/** Returns the object in the metadata key `model`, with checked values. @param {string} text
 * @returns {Description} */
function describe(text) {
    refuse(!isText(text), "metadata key 'model' is missing");
    let description;
    try {
        description = JSON.parse(text);
    } catch {
        throw new ModelError("metadata key 'model' is not JSON");
    }
    refuse(!isObject(description), "metadata key 'model': is not an object of keys and values");
    const {name, inputs, levels, centre, scale, provenance, up = "y", front, credit = ""} = description;
    refuse(!isText(name) || !name, "name: not a text, or empty");
    refuse(inputs !== "xyz" && inputs !== "xyzt", "inputs: is neither 'xyz' nor 'xyzt'");
    refuse(!Array.isArray(levels) || !levels.length, "levels: there must be at least one");
    levels.forEach((/** @type {Record<string, number>} */ level, /** @type {number} */ i) => {
        refuse(!isObject(level), `levels[${i + 1}]: is not an object of keys and values`);
        for (const key of ["delta", "lipschitz"])
            refuse(!isBetween(level[key], SMALLEST, LARGEST), `levels[${i + 1}].${key}: must be a positive number`);
        for (const key of STEP_BOUNDS) {
            const {[key]: bound = FORMAT.default_step_bound} = level;
            refuse(!isBetween(bound, SMALLEST, 1), `levels[${i + 1}].${key}: must be a positive number of at most 1`);
        }
        const most = FORMAT.most_iterations;
        refuse(
            !(Number.isInteger(level.iterations) && level.iterations >= 1 && level.iterations <= most),
            `levels[${i + 1}].iterations: must be a whole number from 1 to ${most}`,
        );
    });
    const isList = (/** @type {unknown} */ list, /** @type {number[]} */ ...most) => (
        Array.isArray(list) && list.length === most.length && most.every((end, i) => isBetween(list[i], -end, end))
    );
    refuse(!isList(centre, LARGEST, LARGEST, LARGEST), "centre: three finite numbers are needed");
    refuse(!isBetween(scale, SMALLEST, LARGEST), "scale: must be a positive number");
    refuse(!isObject(provenance), "provenance: is not an object of keys and values");
    refuse(!isText(up) || !/^-?[xyz]$/.test(up), "up: is none of y, z, x, -y, -z, -x");
    refuse(
        front !== undefined && !isList(front, 360, 90),
        "front: azimuth from -360 to 360, elevation from -90 to 90 degrees",
    );
    refuse(!isText(credit), "credit: not a text");
    return {...description, front: front ?? null, credit};
}

/** Returns a tensor at an offset from `start`; the values of type U8 are bytes. sizes: bytes of a value by the types
 * that are allowed. steps: of whole numbers.
 * @param {string} name @param {Entry} entry @param {ArrayBuffer} buffer @param {number} start
 * @param {Record<string, number>} sizes @param {number[]} [steps]
 * @returns {{shape: number[], values: Float32Array | Uint8Array}} */
function readTensor(name, entry, buffer, start, sizes, steps) {
    const size = sizes[entry?.dtype];
    refuse(!size, `${name}: must be float32`);
    const {shape, data_offsets: offsets} = entry;
    const isSize = (/** @type {number} */ value) => Number.isInteger(value) && value >= 0;
    refuse(
        !Array.isArray(shape) || !shape.every(isSize) || !Array.isArray(offsets) || !offsets.every(isSize),
        `${name}: its entry in the header is damaged`,
    );
    const count = shape.reduce((product, side) => product * side, 1);
    const [from, to] = offsets;
    refuse(to - from !== count * size || start + to > buffer.byteLength, `${name}: the file is cut short or damaged`);
    if (sizes.U8) return {shape, values: new Uint8Array(buffer, start + from, count)};
    const view = new DataView(buffer, start + from, to - from);
    const values = steps ? readWholes(view, count, size, steps) : readFloats(view, count, size);
    refuse(!values.every(Number.isFinite), `${name}: has values that are not finite`);
    return {shape, values};
}

/** Returns the whole numbers of a DataView times a step: one for all, or one for each row. Of 16-bit numbers, the
 * view holds all high bytes, then all low bytes.
 * @param {DataView} view @param {number} count @param {number} size @param {number[]} steps */
function readWholes(view, count, size, steps) {
    /** @param {number} i */
    const whole = (i) => (size === 1 ? view.getInt8(i) : 256 * view.getInt8(i) + view.getUint8(count + i));
    return Float32Array.from({length: count}, (_, i) => steps[Math.floor(i * steps.length / count)] * whole(i));
}

/** Returns the first numbers of a DataView, of `size` bytes, 2 or 4.
 * @param {DataView} view @param {number} count @param {number} size */
export function readFloats(view, count, size) {
    const values = new Float32Array(count);
    for (let i = 0; i < count; ++i)
        values[i] = size === 4 ? view.getFloat32(4 * i, true) : float16(view.getUint16(2 * i, true));
    return values;
}

/** Returns the value of an IEEE 754 half. @param {number} bits */
function float16(bits) {
    const exponent = (bits >> 10) & 31, mantissa = bits & 1023, sign = bits & 0x8000 ? -1 : 1;
    if (exponent === 31) return mantissa ? NaN : sign * Infinity;
    return sign * (exponent ? 2 ** (exponent - 25) * (1024 + mantissa) : 2 ** -24 * mantissa);
}

/** Removes the layers of a network from `tensors`, and checks that their shapes lead from `inputs` to `outputs`.
 * @param {Map<string, Tensor>} tensors @param {string} prefix @param {number} inputs @param {number} outputs */
function takeNetwork(tensors, prefix, inputs, outputs) {
    const layers = [];
    let columns = inputs;
    for (let j = 0, weight; (weight = tensors.get(`${prefix}.layer${j}.weight`)); ++j) {
        const name = `${prefix}.layer${j}`, bias = tensors.get(`${name}.bias`);
        if (!bias) throw new ModelError(`${name}.bias: missing`);
        const [rows, width] = weight.shape;
        refuse(
            weight.shape.length !== 2 || width !== columns,
            `${name}.weight: shape (${weight.shape.join(", ")}), expected (out, ${columns})`,
        );
        refuse(rows < 1 || rows > FORMAT.widest, `${name}.weight: ${rows} outputs, expected 1 to ${FORMAT.widest}`);
        refuse(
            bias.shape.length !== 1 || bias.shape[0] !== rows,
            `${name}.bias: shape (${bias.shape.join(", ")}), expected (${rows},)`,
        );
        layers.push({rows, columns, weight: weight.values, bias: bias.values});
        tensors.delete(`${name}.weight`);
        tensors.delete(`${name}.bias`);
        columns = rows;
    }
    refuse(layers.length < 2, `${prefix}: needs at least two layers (layer0, layer1)`);
    refuse(columns !== outputs, `${prefix}.layer${layers.length - 1}.weight: ${columns} outputs, expected ${outputs}`);
    return layers;
}

/** @param {unknown} condition @param {string} message */
function refuse(condition, message) {
    if (condition) throw new ModelError(message);
}

/** @param {unknown} value @param {number} least @param {number} most */
function isBetween(value, least, most) {
    return typeof value === "number" && value >= least && value <= most;
}

/** @param {unknown} value @returns {value is string} */
function isText(value) {
    return typeof value === "string";
}

/** @param {unknown} value */
function isObject(value) {
    return typeof value === "object" && value !== null && !Array.isArray(value);
}
