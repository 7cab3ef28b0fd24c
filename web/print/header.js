import {facts, shared} from "../model/facts.js";

// Writes the header line of a text, byte for byte as codegen/targets/header.py.

/** Returns the line. sha256: of hashOf(), or "" to omit it; further: more facts, in their order.
 * @param {Model} model @param {string} target @param {string} sha256 */
export function headerLine({name, levels, front, credit}, target, sha256, further = {}) {
    const sizes = levels.map(({network}) => `${network[0].rows}x${network.length - 2}`);
    return `// ${
        pythonJson({
            mplicits: facts.mplicits,
            target,
            name,
            ...(sha256 && {sha256: sha256.slice(0, 12)}),
            levels: sizes,
            ...(front && {front}),
            ...(credit && {credit}),
            ...further,
        })
    }`;
}

/** Resolves to the hash of a model in a valid file with 32-bit weights (Model.sha256), hexadecimal; to "" where the
 * browser computes no hashes, which is on plain http.
 * @param {ArrayBuffer} buffer */
export async function hashOf(buffer) {
    if (!globalThis.crypto?.subtle) return "";
    const length = Number(new DataView(buffer).getBigUint64(0, true)), encoder = new TextEncoder();
    const {__metadata__: {model}, ...tensors} = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, length)));
    const {step_bounds: bounds, default_step_bound: usual} = shared.format;
    const levels = /** @type {Record<string, number>[]} */ (JSON.parse(model).levels).map(
        ({delta, iterations, lipschitz, ...level}) => {
            const unusual = bounds.filter((key) => (level[key] ?? usual) !== usual).map((key) => [key, level[key]]);
            return {delta, iterations: BigInt(iterations), lipschitz, ...Object.fromEntries(unusual)};
        },
    );
    const parts = [encoder.encode(pythonJson(levels))];
    const add = (/** @type {string} */ key) => {
        const {shape, data_offsets: [from, to]} = tensors[key];
        parts.push(encoder.encode(`${key}(${shape.join(", ")}${shape.length === 1 ? "," : ""})`));
        parts.push(new Uint8Array(buffer, 8 + length + from, to - from));
    };
    for (const prefix of [...levels.map((_, i) => `level${i + 1}`), "texture"]) {
        for (let j = 0; `${prefix}.layer${j}.weight` in tensors; ++j) {
            for (const kind of ["weight", "bias"]) add(`${prefix}.layer${j}.${kind}`);
        }
    }
    const digest = await crypto.subtle.digest("SHA-256", await new Blob(parts).arrayBuffer());
    return Array.from(new Uint8Array(digest), (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Returns JSON as Python writes it. Numbers are Python's floats; its integers are bigints.
 * @param {unknown} value @returns {string} */
export function pythonJson(value) {
    if (typeof value === "bigint") return String(value);
    if (typeof value === "number") return pythonFloat(value);
    if (Array.isArray(value)) return `[${value.map(pythonJson).join(", ")}]`;
    if (typeof value === "object") {
        const entries = Object.entries(/** @type {object} */ (value)).map((entry) => entry.map(pythonJson).join(": "));
        return `{${entries.join(", ")}}`;
    }
    const escaped = (/** @type {string} */ unit) => `\\u${unit.charCodeAt(0).toString(16).padStart(4, "0")}`;
    return JSON.stringify(value).replace(/[^\0-~]/g, escaped);
}

/** @param {number} x */
function pythonFloat(x) {
    const [mantissa, exponent] = x.toExponential().split("e");
    if (x && (+exponent < -4 || +exponent >= 16))
        return `${mantissa}e${exponent.replace(/^([+-])(\d)$/, "$10$2")}`;
    return String(x).includes(".") ? String(x) : `${x}.0`;
}
