import {demand, Faces} from "./mesh_parts.js";

// Reads vertices and faces of a Wavefront OBJ file.
export function parseObj(buffer) {
    const text = new TextDecoder().decode(buffer).replaceAll("\\\n", " "), faces = new Faces(), vertices = [];
    let start = 0, line = 0;
    while (start < text.length) {
        let end = text.indexOf("\n", start);
        if (end < 0) end = text.length;
        ++line;
        const isVertex = text.startsWith("v ", start) || text.startsWith("v\t", start);
        const isFace = text.startsWith("f ", start) || text.startsWith("f\t", start);
        if (isVertex || isFace) {
            const words = text.slice(start + 2, end).trim().split(/\s+/);
            if (isVertex) addVertex(vertices, words, line);
            else faces.add(words.map((word) => cornerOf(word, vertices.length / 3, line)));
        }
        start = end + 1;
    }
    return {vertices: Float64Array.from(vertices), faces: faces.triangles};
}

function addVertex(vertices, words, line) {
    for (let k = 0; k < 3; ++k) {
        const number = Number(words[k]);
        demand(words[k] !== undefined && !Number.isNaN(number), `line ${line}: a vertex needs three numbers`);
        vertices.push(number);
    }
}

// Returns the index of a corner such as 3, 3/1, 3//2, or -1 for the last vertex so far.
function cornerOf(word, count, line) {
    const number = Number.parseInt(word, 10), index = number < 0 ? count + number : number - 1;
    demand(index >= 0 && index < 2 ** 32, `line ${line}: '${word.slice(0, 20)}' names no vertex`);
    return index;
}
