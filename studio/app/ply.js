import {numberAt, SIZES, viewOf} from "./binary.js";
import {cornerCoordinates, demand, demandFew, Growing, unitColors} from "./mesh_parts.js";
import {Polygons} from "./polygons.js";
import {TextReader} from "./text_reader.js";

// Reads a PLY file: a mesh or a cloud, text or binary in either order of bytes.
const TYPES = {
    char: "int8", uchar: "uint8", short: "int16", ushort: "uint16", int: "int32", uint: "uint32", float: "float32",
    double: "float64",
};
// Names of properties. Each group is an array; its first names that a file has are taken.
export const GROUPS = {
    vertices: ["x y z"], normals: ["nx ny nz", "normal_x normal_y normal_z"],
    tints: ["red green blue", "diffuse_red diffuse_green diffuse_blue", "r g b"],
    table: ["s t", "u v", "texture_u texture_v"],
};
const CORNERS = ["vertex_indices", "vertex_index"], STRIPS = "tristrips";

// Returns what parsedShape (mesh_file.js) describes.
export function parsePly(bytes, find) {
    const {elements, encoding, textures, start} = plyHeader(bytes), faces = new FaceReader();
    const isText = encoding === "ascii", source = isText ? new TextReader(bytes, start)
        : new BinaryNumbers(bytes, start, encoding === "binary_little_endian");
    let shape = {};
    for (const {name, count, properties} of elements) {
        const least = properties.reduce((sum, {type, list}) => sum + (isText ? 2 : SIZES[list ?? type]), 0);
        demand(count * least <= bytes.length + 1, "a count does not fit the file");
        if (name === "vertex") shape = vertexArrays(properties, count);
        const isFace = name === "face" || name === STRIPS;
        if (isFace) faces.begin(properties, name === STRIPS);
        for (let i = 0; i < count; ++i) {
            for (const property of properties) {
                if (property.list) {
                    faces.read(source, property);
                } else {
                    const value = source.next(property.type);
                    if (property.to) property.to[property.width * i + property.place] = property.scale * value;
                }
            }
            if (isFace) faces.finish();
        }
    }
    demand(shape.vertices, "the vertices have no x, y and z");
    return {...shape, tints: shape.tints && unitColors(shape.tints), ...faces.result(shape, textures, find)};
}

// Gives properties places in arrays, {vertices, normals, tints, table}, and returns those that the file has.
function vertexArrays(properties, count) {
    const arrays = {};
    demand(!properties.some(({name}) => name === "packed_position"), "compressed Gaussian splats, which are no surface");
    for (const [group, choices] of Object.entries(GROUPS)) {
        const found = chosenProperties(properties, choices);
        if (!found) continue;
        demandFew(count / 3, "points");
        const exact = group === "vertices" || group === "normals";
        arrays[group] = new (exact ? Float64Array : Float32Array)(count * found.length);
        found.forEach((property, place) => {
            const scale = group === "tints" ? colorScale(property.type) : 1;
            Object.assign(property, {to: arrays[group], width: found.length, place, scale});
        });
    }
    return arrays;
}

export function chosenProperties(properties, choices) {
    const named = (name) => properties.find((property) => property.name === name && !property.list);
    return choices.map((names) => names.split(" ").map(named)).find((found) => found.every(Boolean));
}

function colorScale(type) {
    return type.startsWith("float") ? 1 : 1 / (type === "uint16" ? 65535 : 255);
}

// Reads faces or strips, with their texture coordinates and colors.
class FaceReader {
    constructor() {
        this.polygons = new Polygons();
        this.corners = new Growing(Uint32Array);
        this.wedges = new Growing(Float32Array);
        this.table = new Growing(Float32Array);
        this.texture = new Float64Array(1);
        this.color = new Float64Array(3);
        this.colors = new Map();
    }

    begin(properties, isStrip) {
        const colors = chosenProperties(properties, GROUPS.tints), number = properties.find(({name}) => name === "texnumber");
        colors?.forEach((property, place) => {
            Object.assign(property, {to: this.color, width: 0, place, scale: colorScale(property.type)});
        });
        if (number && !number.list) Object.assign(number, {to: this.texture, width: 0, place: 0, scale: 1});
        this.isColored = Boolean(colors);
        this.isStrip = isStrip;
    }

    // Reads a list of a row.
    read(source, {name, type, list}) {
        const count = source.next(list), isCorners = CORNERS.includes(name);
        const to = isCorners ? this.corners : name === "texcoord" ? this.wedges : null;
        if (to) to.size = 0;
        for (let k = 0; k < count; ++k) {
            const value = source.next(type);
            if (to) to.push(isCorners && !(value >= 0) ? 2 ** 32 - 1 : value);
        }
    }

    // Ends a row.
    finish() {
        const {corners, wedges, table, polygons} = this;
        if (this.isStrip) {
            addStrip(corners, polygons);
        } else {
            const hasWedges = wedges.size >= 2 * corners.size;
            for (let k = 0; k < corners.size; ++k) {
                polygons.add(corners.array[k], hasWedges ? table.size / 2 : -1);
                for (let i = 0; hasWedges && i < 2; ++i) table.push(wedges.array[2 * k + i]);
            }
            polygons.finish(this.isColored ? this.colorIndex() : this.texture[0]);
        }
        corners.size = wedges.size = 0;
    }

    // Returns the material of a color: colors that agree to 5 or 6 bits are one, so that indices need 16 bits.
    colorIndex() {
        const [r, g, b] = this.color, key = Math.round(31 * r) + 32 * Math.round(63 * g) + 2048 * Math.round(31 * b);
        if (!this.colors.has(key)) this.colors.set(key, {index: this.colors.size, color: [...unitColors(this.color)]});
        return this.colors.get(key).index;
    }

    result({vertices, table}, textures, find) {
        const {polygons} = this, wedges = this.table.filled;
        polygons.cutEars(vertices);
        const faces = polygons.vertices.filled, places = polygons.places.filled;
        const uv = wedges.length ? cornerCoordinates(wedges, places) : table ? cornerCoordinates(table, faces) : null;
        const material = polygons.materials.filled;
        const materials = Array.from(this.colors.values(), ({color}) => ({color, image: null}));
        if (!materials.length) for (const name of textures) materials.push({color: null, image: {name, bytes: find(name)}});
        return {faces, uv, material, materials};
    }
}

// Adds the triangles of strips, which -1 parts. Every other triangle is turned; strips repeat a vertex to turn.
function addStrip({array, size}, polygons) {
    for (let i = 0, start = 0; i < size; ++i) {
        if (array[i] === 2 ** 32 - 1) {
            start = i + 1;
        } else if (i - start > 1 && new Set(array.subarray(i - 2, i + 1)).size === 3) {
            const isTurned = (i - start) % 2;
            for (const k of [i - 2, isTurned ? i : i - 1, isTurned ? i - 1 : i]) polygons.add(array[k]);
            polygons.finish();
        }
    }
}

// Returns {elements: [{name, count, properties: [{name, type, list}]}], encoding, textures, start}: list is the type
// of a list's length, or null; textures are names of images; start is the offset of the data.
function plyHeader(bytes) {
    const text = new TextDecoder("latin1").decode(bytes.subarray(0, 65536));
    const found = /^ply *(\r\n|\n|\r)(?:[^]*?[\r\n])?end_header *(?:\1|\n|\r)/.exec(text);
    demand(found, "not a PLY file, or a damaged one");
    const elements = [], textures = [];
    let encoding = "";
    for (const line of found[0].split(/[\r\n]+/)) {
        const [word, first, ...rest] = line.trim().split(/\s+/);
        if (word === "format") encoding = first;
        if (word === "comment" && first === "TextureFile") textures.push(line.trim().slice(20).trim());
        if (word === "element") elements.push({name: first, count: countOf(rest[0]), properties: []});
        if (word === "property") {
            const [type, name, list] = first === "list" ? [rest[1], rest[2], typeOf(rest[0])] : [first, rest[0], null];
            demand(elements.length, "a property precedes the elements");
            elements[elements.length - 1].properties.push({name, type: typeOf(type), list});
        }
    }
    demand(/^(ascii|binary_(little|big)_endian)$/.test(encoding), "its format is neither ascii nor binary");
    return {elements, encoding, textures, start: found[0].length};
}

function typeOf(name) {
    const type = Object.hasOwn(TYPES, name) ? TYPES[name] : name;
    demand(Object.hasOwn(SIZES, type), `'${String(name).slice(0, 20)}' is not a type of PLY`);
    return type;
}

function countOf(word) {
    const count = Number(word);
    demand(Number.isInteger(count) && count >= 0, "a count is no number");
    return count;
}

// The numbers of binary data. Throws RangeError at the end.
class BinaryNumbers {
    constructor(bytes, start, isLittle) {
        Object.assign(this, {view: viewOf(bytes), at: start, isLittle});
    }

    next(type) {
        const value = numberAt(this.view, type, this.at, this.isLittle);
        this.at += SIZES[type];
        return value;
    }
}
