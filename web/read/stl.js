import {viewOf} from "./binary.js";
import {demand, demandFew, firstNumbers, Growing} from "./mesh_parts.js";
import {TextReader} from "./text_reader.js";

// Reads a binary or text STL file: triangles without shared vertices.
const VERTEX_LETTER = 118, LOWER_CASE = 32;

/** @param {Uint8Array} bytes */
export function parseStl(bytes) {
    const view = viewOf(bytes), count = bytes.length >= 84 ? view.getUint32(80, true) : Infinity;
    const left = bytes.length - 84 - 50 * count; // some programs add bytes, some begin with "solid"
    const isText = /^\s*solid\s[^]*?\sfacet\s/.test(new TextDecoder("latin1").decode(bytes.subarray(0, 2000)));
    const vertices = left === 0 || (left > 0 && !isText) ? binaryStl(view, count) : textStl(bytes);
    return {vertices, faces: firstNumbers(Uint32Array, vertices.length / 3)};
}

/** @param {DataView} view @param {number} count */
function binaryStl(view, count) {
    demandFew(count, "triangles");
    const vertices = new Float64Array(9 * count);
    for (let i = 0; i < count; ++i) {
        for (let k = 0; k < 9; ++k) vertices[9 * i + k] = view.getFloat32(84 + 50 * i + 12 + 4 * k, true);
    }
    return vertices;
}

/** @param {Uint8Array} bytes */
function textStl(bytes) {
    const text = new TextReader(bytes), numbers = new Growing(Float64Array);
    demand(text.nextLine() && text.word().toLowerCase() === "solid", "not an STL file, or a damaged one");
    while (text.nextLine()) {
        if ((text.peek() | LOWER_CASE) !== VERTEX_LETTER) continue; // no other line begins so
        text.number();
        for (let k = 0; k < 3; ++k) {
            const number = text.number();
            if (Number.isNaN(number)) demand(false, `line ${text.line}: a vertex needs three numbers`);
            numbers.push(number);
        }
    }
    demandFew(numbers.size / 9, "triangles");
    demand(numbers.size % 9 === 0, "a facet has not three vertices");
    return numbers.filled;
}
