import {cornerCoordinates, demand, Growing, shownName, unitColors} from "./mesh_parts.js";
import {parseMtl} from "./mtl.js";
import {Polygons} from "./polygons.js";
import {TextReader} from "./text_reader.js";
/** @import {Find, Parsed} from "./mesh_file.js" */
/** @import {Material} from "./mtl.js" */

// Reads a Wavefront OBJ file with its normals and materials, and with colors behind the vertices' coordinates.
const V = 118, T = 116, N = 110, F = 102, U = 117, M = 109, SLASH = 47, BLANK = 32;
const MOST_MATERIALS = 65_000;

/** @param {Uint8Array} bytes @param {Find} find @returns {Parsed} */
export function parseObj(bytes, find) {
    const text = new TextReader(bytes), points = new Growing(Float64Array), tints = new Growing(Float32Array);
    const table = new Growing(Float32Array), normals = new Growing(Float64Array), polygons = new Polygons();
    const names = new Map(), libraries = /** @type {string[]} */ ([]);
    let material = 0;
    const use = (/** @type {string} */ name) => {
        if (!names.has(name)) names.set(name, names.size);
        demand(names.size <= MOST_MATERIALS, "too many materials");
        material = names.get(name);
    };
    use("");
    while (text.nextLine()) {
        const first = text.peek(), second = bytes[text.at + 1];
        if (first === V && second <= BLANK) {
            ++text.at;
            addVertex(text, points, tints);
        } else if (first === V && second === T) {
            text.at += 2;
            for (let k = 0; k < 2; ++k) table.push(text.number());
        } else if (first === V && second === N) {
            text.at += 2;
            for (let k = 0; k < 3; ++k) normals.push(text.number());
        } else if (first === F && second <= BLANK) {
            ++text.at;
            addFace(text, points.size / 3, table.size / 2, normals.size / 3, polygons);
            polygons.finish(material);
        } else if (first === U || first === M) {
            const word = text.word();
            if (word === "usemtl") use(text.rest());
            if (word === "mtllib") libraries.push(text.rest());
        }
    }
    if (tints.size) tints.fill(1, points.size);
    polygons.cutEars(points.array);
    const {materials, notes} = materialsOf([...names.keys()], libraries, find);
    const uv = cornerCoordinates(table.filled, polygons.places.filled), used = polygons.materials.filled;
    const normalOf = polygons.normals.filled;
    uv?.forEach((c, i) => {
        const {scale, offset} = materials[used[Math.floor(i / 6)]];
        uv[i] = scale[i % 2] * c + offset[i % 2];
    });
    return {
        vertices: points.filled,
        faces: polygons.vertices.filled,
        tints: tints.size ? unitColors(tints.filled) : null,
        ...(normalOf.length && normalOf.every((place) => place >= 0) ? {normals: normals.filled, normalOf} : {}),
        uv,
        material: used,
        materials,
        notes,
    };
}

/** @param {TextReader} text @param {Growing<Float64Array>} points @param {Growing<Float32Array>} tints */
function addVertex(text, points, tints) {
    for (let k = 0; k < 3; ++k) {
        const number = text.number();
        if (Number.isNaN(number)) demand(false, `line ${text.line}: a vertex needs three numbers`);
        points.push(number);
    }
    if (!text.peek()) return;
    const [r, g, b] = [text.number(), text.number(), text.number()];
    if (Number.isNaN(b)) return; // a weight
    tints.fill(1, points.size - 3);
    for (const c of [r, g, b]) tints.push(c);
}

/** Adds a polygon of corners such as 3, 3/1, 3//2, 3/1/2; -1 is the last vertex so far.
 * @param {TextReader} text @param {number} count @param {number} places @param {number} normals sizes of the tables
 * @param {Polygons} polygons */
function addFace(text, count, places, normals, polygons) {
    const {bytes} = text;
    while (text.peek()) {
        const start = text.at, number = text.integer(), index = number < 0 ? count + number : number - 1;
        if (!(index >= 0 && index < 2 ** 32)) {
            text.at = start;
            demand(false, `line ${text.line}: '${text.word().slice(0, 20)}' names no vertex`);
        }
        /** @type {[number, number]} */
        const more = [-1, -1]; // places in both tables
        for (let k = 0; k < 2 && bytes[text.at] === SLASH; ++k) {
            ++text.at;
            const other = text.integer();
            more[k] = other < 0 ? (k ? normals : places) + other : other > 0 ? other - 1 : -1;
        }
        polygons.add(index, ...more);
    }
}

/** Returns the materials of some names. @param {string[]} names @param {string[]} libraries @param {Find} find */
function materialsOf(names, libraries, find) {
    /** @type {Map<string, Material>} */
    const known = new Map(), notes = [];
    for (const library of libraries.length ? libraries.slice(0, 100) : [""]) {
        const bytes = find(library, /\.mtl$/i);
        if (bytes) parseMtl(bytes).forEach((material, name) => known.set(name, material));
        else if (library) notes.push(`the materials ${shownName(library)} are missing`);
    }
    const materials = names.map((name) => {
        const {color = null, file = null, scale = [1, 1], offset = [0, 0]} = known.get(name) ?? {};
        return {color, image: file ? {name: file, bytes: find(file)} : null, scale, offset};
    });
    return {materials, notes};
}
