import {demand, Faces} from "./mesh_parts.js";

// Reads vertices and faces of a PLY file: text, or binary in either order of bytes.
const TYPES = {
    char: [1, "getInt8"], uchar: [1, "getUint8"], short: [2, "getInt16"], ushort: [2, "getUint16"],
    int: [4, "getInt32"], uint: [4, "getUint32"], float: [4, "getFloat32"], double: [8, "getFloat64"],
};
const OTHER_NAMES = {
    int8: "char", uint8: "uchar", int16: "short", uint16: "ushort", int32: "int", uint32: "uint", float32: "float",
    float64: "double",
};
const CORNERS = ["vertex_indices", "vertex_index"];

export function parsePly(buffer) {
    const {elements, encoding, start} = plyHeader(buffer);
    const little = encoding.endsWith("little_endian");
    const next = encoding === "ascii" ? words(buffer, start) : numbers(buffer, start, little);
    const faces = new Faces();
    let vertices = new Float64Array(0);
    for (const {name, count, properties} of elements) {
        const places = ["x", "y", "z"].map((axis) => properties.findIndex((property) => property.name === axis));
        if (name === "vertex") {
            demand(!places.includes(-1), "the vertices have no x, y and z");
            vertices = new Float64Array(3 * count);
        }
        for (let i = 0; i < count; ++i) {
            properties.forEach((property, k) => {
                const value = property.list ? listOf(property, next) : next(property.type);
                if (name === "vertex" && places.includes(k)) vertices[3 * i + places.indexOf(k)] = value;
                if (name === "face" && CORNERS.includes(property.name)) faces.add(value);
            });
        }
    }
    return {vertices, faces: faces.triangles};
}

// Returns {elements: [{name, count, properties: [{name, type, list}]}], encoding, start}: list is the type of a list's
// length, or null; start is the offset of the data.
function plyHeader(buffer) {
    const text = new TextDecoder("latin1").decode(buffer.slice(0, 65536)), found = /^end_header *\r?\n/m.exec(text);
    demand(text.startsWith("ply") && found, "not a PLY file, or a damaged one");
    const elements = [];
    let encoding = "";
    for (const line of text.slice(0, found.index).split(/\r?\n/)) {
        const [word, first, ...rest] = line.trim().split(/\s+/);
        if (word === "format") encoding = first;
        if (word === "element") elements.push({name: first, count: countOf(rest[0], buffer), properties: []});
        if (word === "property") {
            const [type, name, list] = first === "list" ? [rest[1], rest[2], typeOf(rest[0])] : [first, rest[0], null];
            demand(elements.length, "a property precedes the elements");
            elements[elements.length - 1].properties.push({name, type: typeOf(type), list});
        }
    }
    demand(/^(ascii|binary_(little|big)_endian)$/.test(encoding), "its format is neither ascii nor binary");
    return {elements, encoding, start: found.index + found[0].length};
}

function typeOf(name) {
    const type = OTHER_NAMES[name] ?? name;
    demand(Object.hasOwn(TYPES, type), `'${String(name).slice(0, 20)}' is not a type of PLY`);
    return type;
}

// An element takes at least a byte, so a damaged count is found before memory is reserved for it.
function countOf(word, buffer) {
    const count = Number(word);
    demand(Number.isInteger(count) && count >= 0 && count <= buffer.byteLength, "a count does not fit the file");
    return count;
}

function listOf({type, list}, next) {
    const size = next(list), values = [];
    for (let k = 0; k < size; ++k) values.push(next(type));
    return values;
}

// Returns a function that returns the next number of a text; the type does not matter.
function words(buffer, start) {
    const text = new TextDecoder("latin1").decode(buffer.slice(start)), each = /\S+/g;
    return () => {
        const found = each.exec(text), number = found ? Number(found[0]) : NaN;
        if (Number.isNaN(number) && found?.[0].toLowerCase() !== "nan") throw new RangeError("no number");
        return number;
    };
}

// Returns a function that returns the next number of a type. Throws RangeError at the end of the buffer.
function numbers(buffer, start, little) {
    const view = new DataView(buffer);
    let at = start;
    return (type) => {
        const [size, get] = TYPES[type], value = view[get](at, little);
        at += size;
        return value;
    };
}
