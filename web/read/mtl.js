import {TextReader} from "./text_reader.js";

/** A material of a Wavefront MTL file. color: Kd, sRGB; file: name of the image; scale, offset: of its coordinates.
 * @typedef {{color: number[] | null, file: string | null, scale: number[], offset: number[]}} Material */
const OPTION = /^-(?:(?:o|s|t|mm|bm|boost|texres)(?:\s+[-+.\de]+)+|(?:blendu|blendv|cc|clamp|imfchan|type)\s+\S+)\s+/;

/** Returns the materials of a file by their names. @param {Uint8Array} bytes */
export function parseMtl(bytes) {
    const text = new TextReader(bytes);
    /** @type {Map<string, Material>} */
    const materials = new Map();
    let material = /** @type {Material} */ ({});
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

/** Parts a map's line: options, and a name that may have blanks. @param {string} line @returns {Partial<Material>} */
function mapOf(line) {
    /** @type {Partial<Material>} */
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
