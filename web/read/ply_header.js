import {SIZES} from "./binary.js";
import {demand} from "./mesh_parts.js";
/** @import {NumberType} from "./binary.js" */

// The header of a PLY file, and the names of its properties.

/** A property of an element. list: type of a list's length. A number goes to place + width * row of an array.
 * @typedef {{name: string, type: NumberType, list: NumberType}} List
 * @typedef {{name: string, type: NumberType, list: null, to?: undefined}} Unused
 * @typedef {{name: string, type: NumberType, list: null, to: Float64Array | Float32Array, width: number, place: number,
 *     scale: number}} Used
 * @typedef {List | Unused | Used} Property */
/** @typedef {{name: string, count: number, properties: Property[]}} Element */

/** @type {Record<string, NumberType>} */
const TYPES = {
    char: "int8",
    uchar: "uint8",
    short: "int16",
    ushort: "uint16",
    int: "int32",
    uint: "uint32",
    float: "float32",
    double: "float64",
};
// Names of properties. Each group is an array; its first names that a file has are taken.
export const GROUPS = {
    vertices: ["x y z"],
    normals: ["nx ny nz", "normal_x normal_y normal_z"],
    tints: ["red green blue", "diffuse_red diffuse_green diffuse_blue", "r g b"],
    table: ["s t", "u v", "texture_u texture_v"],
};

/** Returns the elements, the names of images, and the offset of the data. @param {Uint8Array} bytes */
export function plyHeader(bytes) {
    const text = new TextDecoder("latin1").decode(bytes.subarray(0, 65536));
    const found = /^ply *(\r\n|\n|\r)(?:[^]*?[\r\n])?end_header *(?:\1|\n|\r)/.exec(text);
    demand(found, "not a PLY file, or a damaged one");
    const elements = /** @type {Element[]} */ ([]), textures = [];
    let encoding = "";
    for (const line of found[0].split(/[\r\n]+/)) {
        const [word, first, ...rest] = line.trim().split(/\s+/);
        if (word === "format") encoding = first;
        if (word === "comment" && first === "TextureFile") textures.push(line.trim().slice(20).trim());
        if (word === "element") elements.push({name: first, count: countOf(rest[0]), properties: []});
        if (word === "property") {
            const [type, name, list] = first === "list" ? [rest[1], rest[2], typeOf(rest[0])] : [first, rest[0], null];
            demand(elements.length, "a property precedes the elements");
            elements[elements.length - 1].properties.push(/** @type {Property} */ ({name, type: typeOf(type), list}));
        }
    }
    demand(/^(ascii|binary_(little|big)_endian)$/.test(encoding), "its format is neither ascii nor binary");
    return {elements, encoding, textures, start: found[0].length};
}

/** @param {string} name @returns {NumberType} */
function typeOf(name) {
    const type = Object.hasOwn(TYPES, name) ? TYPES[name] : /** @type {NumberType} */ (name);
    demand(Object.hasOwn(SIZES, type), `'${String(name).slice(0, 20)}' is not a type of PLY`);
    return type;
}

/** @param {string} word */
function countOf(word) {
    const count = Number(word);
    demand(Number.isInteger(count) && count >= 0, "a count is no number");
    return count;
}

/** Returns the properties of the first of a group's names that are all there.
 * @template {{name: string, list?: NumberType | null}} P
 * @param {P[]} properties @param {string[]} choices @returns {P[] | undefined} */
export function chosenProperties(properties, choices) {
    const named = (/** @type {string} */ name) =>
        properties.find((property) => property.name === name && !property.list);
    const found = choices.map((names) => names.split(" ").map(named)).find((found) => found.every(Boolean));
    return /** @type {P[] | undefined} */ (found);
}

/** Returns what makes a color of a type be in [0, 1]. @param {NumberType} type */
export function colorScale(type) {
    return type.startsWith("float") ? 1 : 1 / (type === "uint16" ? 65535 : 255);
}
