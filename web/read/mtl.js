import {TextReader} from "./text_reader.js";

// Reads the materials of a Wavefront MTL file.
const OPTION = /^-(?:(?:o|s|t|mm|bm|boost|texres)(?:\s+[-+.\de]+)+|(?:blendu|blendv|cc|clamp|imfchan|type)\s+\S+)\s+/;

// Returns name -> {color, file, scale, offset}. color: Kd, sRGB, or null; file: name of the image, or null; scale,
// offset: of its texture coordinates.
export function parseMtl(bytes) {
    const text = new TextReader(bytes), materials = new Map();
    let material = {};
    while (text.nextLine()) {
        const word = text.word().toLowerCase();
        if (word === "newmtl") {
            material = {color: null, file: null, scale: [1, 1], offset: [0, 0]};
            materials.set(text.rest(), material);
        } else if (word === "kd") {
            const color = [text.number(), text.number(), text.number()];
            if (!color.some(Number.isNaN)) material.color = color.map((c) => Math.min(1, Math.max(0, c)));
        } else if (word === "map_kd" || (word === "map_ka" && !material.file)) {
            Object.assign(material, mapOf(text.rest()));
        }
    }
    return materials;
}

// Returns {file, scale?, offset?} of a map: options, and a name that may have blanks.
function mapOf(line) {
    const map = {};
    let found;
    while ((found = OPTION.exec(line))) {
        const [option, ...numbers] = found[0].trim().split(/\s+/);
        const [u = 0, v = option === "-s" ? 1 : 0] = numbers.map(Number);
        if (option === "-s") map.scale = [u, v];
        if (option === "-o") map.offset = [u, v];
        line = line.slice(found[0].length);
    }
    return {...map, file: line};
}
