import {demand} from "./mesh_parts.js";

// Reads a binary or text STL file: triangles without shared vertices.
export function parseStl(buffer) {
    const view = new DataView(buffer), count = buffer.byteLength >= 84 ? view.getUint32(80, true) : -1;
    const vertices = buffer.byteLength === 84 + 50 * count ? binaryStl(view, count) : textStl(buffer);
    return {vertices, faces: Uint32Array.from({length: vertices.length / 3}, (_, i) => i)};
}

function binaryStl(view, count) {
    const vertices = new Float64Array(9 * count);
    for (let i = 0; i < count; ++i) {
        for (let k = 0; k < 9; ++k) vertices[9 * i + k] = view.getFloat32(84 + 50 * i + 12 + 4 * k, true);
    }
    return vertices;
}

function textStl(buffer) {
    const text = new TextDecoder().decode(buffer);
    demand(text.trimStart().startsWith("solid"), "not an STL file, or a damaged one");
    const numbers = [];
    for (const [, words] of text.matchAll(/^\s*vertex\s+(.*)$/gm)) {
        const three = words.trim().split(/\s+/).map(Number);
        demand(three.length === 3 && !three.some(Number.isNaN), "a vertex needs three numbers");
        numbers.push(...three);
    }
    demand(numbers.length % 9 === 0, "a facet has not three vertices");
    return Float64Array.from(numbers);
}
