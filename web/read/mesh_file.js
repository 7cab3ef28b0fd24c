import {HUGE, SAME} from "../model/constants.js";
import {cleanCloud} from "./cloud_points.js";
import {firstEqual} from "./equal_points.js";
import {parseGlb} from "./glb.js";
import {colorsOf} from "./mesh_colors.js";
import {demand, MeshError, shownName} from "./mesh_parts.js";
import {parseObj} from "./obj.js";
import {parsePly} from "./ply.js";
import {parseStl} from "./stl.js";
import {parseXyz} from "./xyz.js";
/** @import {Points} from "./cloud_points.js" */

// Reads a shape from a file and the files beside it.

/** A file that was dropped. @typedef {{name: string, path?: string, bytes: ArrayBuffer}} InputFile */
/** Returns the bytes of a file by its name in another one; or else, where it is the only one, by its ending.
 * @typedef {(name: string, ending?: RegExp) => Uint8Array | null} Find */
/** A material of a file: sRGB in [0, 1]. A missing color, image, or file of an image is null.
 * @typedef {{color: number[] | null, image: {name: string, bytes: Uint8Array | null} | null}} FoundMaterial */
/** What the reader of a format returns. Its indices are not checked. normals: of vertices, or of corners by normalOf;
 * tints: of vertices; uv: of corners; material: of faces; isProduct: whether tints, colors and images multiply; meshes:
 * their number.
 * @typedef {{vertices: Float64Array, faces: Uint32Array, normals?: Float64Array | null, normalOf?: Int32Array,
 *     tints?: Float32Array | null, uv?: Float32Array | null, material?: Uint16Array | null,
 *     materials?: FoundMaterial[], isProduct?: boolean, notes?: string[], meshes?: number}} Parsed */
/** Normals of any length (3 N), and the one of each corner of faces (3 F).
 * @typedef {{values: Float64Array | Float32Array, index: Uint32Array | Int32Array}} CornerNormals */
/** sRGB in [0, 1]: of vertices (3 V); uv: of the corners of faces (6 F); material: of faces (F), null where all have
 * the first; pixels: RGBA.
 * @typedef {{width: number, height: number, pixels: Uint8ClampedArray}} Picture
 * @typedef {{vertex: Float32Array | null, uv: Float32Array | null, material: Uint16Array | null,
 *     materials: {color: number[], image: Picture | null}[]}} ShapeColors */
/** A shape of a file. Vertices (3 V) at one place are one vertex, and polygons are triangles (3 F); a cloud has no
 * faces, but unit vectors (3 V). notes: lines for the visitor.
 * @typedef {{name: string, vertices: Float64Array, faces: Uint32Array, normals: CornerNormals | null,
 *     cloudNormals: Float64Array | null, colors: ShapeColors | null, notes: string[], up: "y" | null}} ReadShape */

/** @type {Record<string, (bytes: Uint8Array, find: Find) => Parsed>} */
const PARSERS = {obj: parseObj, ply: parsePly, stl: parseStl, glb: parseGlb, gltf: parseGlb, xyz: parseXyz};
const MOST_BYTES = 2 ** 29, MOST_NOTES = 8;

/** Reads the shape of files that were dropped together. Throws MeshError.
 * @param {InputFile[]} files @returns {Promise<ReadShape>} */
export async function readShape(files) {
    const shapes = files.filter(({name}) => Object.hasOwn(PARSERS, endingOf(name)))
        .sort((a, b) => b.bytes.byteLength - a.bytes.byteLength);
    const [{name, bytes} = {name: "", bytes: null}] = shapes, notes = [];
    const parsed = parsedShape(name, bytes, finderOf(files)), isCloud = !parsed.faces.length;
    if (shapes.length > 1) notes.push(`${shapes.length} shapes; ${shownName(name)} is the largest`);
    notes.push(...parsed.notes ?? []);
    if (isCloud) demandNormals(parsed, name);
    const normals = parsed.normals && !isCloud
        ? {values: parsed.normals, index: parsed.normalOf ?? parsed.faces.slice()} :
        null;
    /** @type {{vertices: Float64Array, normals?: Float64Array, tints?: Float32Array | null, notes?: string[]}} */
    const shape = isCloud ? cleanCloud(/** @type {Points} */ (parsed)) : mergedMesh(parsed);
    notes.push(...shape.notes ?? []);
    const colors = await colorsOf({...parsed, tints: shape.tints}, files, notes);
    return {
        name,
        vertices: shape.vertices,
        faces: parsed.faces,
        normals,
        cloudNormals: shape.normals ?? null,
        colors,
        notes: [summary(parsed, shape, colors), ...notes].slice(0, MOST_NOTES),
        up: PARSERS[endingOf(name)] === parseGlb ? "y" : null,
    };
}

/** @param {string} name @param {ArrayBuffer | null} buffer @param {Find} find */
function parsedShape(name, buffer, find) {
    const ending = endingOf(name);
    demand(
        buffer && Object.hasOwn(PARSERS, ending),
        "not a mesh or a cloud that this page reads: OBJ, PLY, STL, GLB or XYZ",
    );
    demand(buffer.byteLength <= MOST_BYTES, `over 512 MB; train it with: mplicits train ${shownName(name)}`);
    try {
        return PARSERS[ending](new Uint8Array(buffer), find);
    } catch (error) {
        if (error instanceof MeshError) throw error;
        throw new MeshError("the file is cut short or damaged", {cause: error});
    }
}

const endingOf = (/** @type {string} */ name) => name.slice(name.lastIndexOf(".") + 1).toLowerCase();

/** Finds a file by its path, or else by its base name. @param {InputFile[]} files @returns {Find} */
function finderOf(files) {
    const plain = (/** @type {string} */ path) => path.replaceAll("\\", "/").replace(/^(\.?\/)+/, "").toLowerCase();
    return (asked, ending) => {
        const path = plain(asked), base = path.slice(path.lastIndexOf("/") + 1);
        const same = files.filter(({name}) => name.toLowerCase() === base);
        const alike = same.length || !ending ? [] : files.filter(({name}) => ending.test(name));
        const found = same.find((file) => `/${plain(file.path ?? file.name)}`.endsWith(`/${path}`)) ?? same[0];
        const only = found ?? (alike.length === 1 ? alike[0] : null);
        return only && new Uint8Array(only.bytes);
    };
}

/** Merges vertices at one place; the first keeps its color. Writes the new indices to faces. @param {Parsed} parsed */
function mergedMesh({vertices, faces, tints = null}) {
    const cell = SAME * extent(vertices, faces) || 1, first = firstEqual(vertices.map((c) => Math.round(c / cell)));
    const count = vertices.length / 3, numbers = new Uint32Array(count); // new index + 1
    const points = new Float64Array(vertices.length), colors = tints && new Float32Array(tints.length);
    let kept = 0;
    for (let i = 0; i < faces.length; ++i) {
        demand(faces[i] < count, "a face names a vertex that does not exist");
        const from = first[faces[i]];
        if (!numbers[from]) {
            for (let k = 0; k < 3; ++k) {
                const number = vertices[3 * from + k];
                demand(Math.abs(number) <= HUGE, "has coordinates that are not finite, or huge");
                points[3 * kept + k] = number;
                if (tints && colors) colors[3 * kept + k] = tints[3 * from + k];
            }
            numbers[from] = ++kept;
        }
        faces[i] = numbers[from] - 1;
    }
    return {vertices: points.slice(0, 3 * kept), tints: colors && colors.slice(0, 3 * kept)};
}

/** Returns the longest side of the box around the vertices of faces.
 * @param {Float64Array} vertices @param {Uint32Array} faces */
function extent(vertices, faces) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const index of faces) {
        for (let k = 0; k < 3; ++k) {
            const number = vertices[3 * index + k];
            if (number < low[k]) low[k] = number;
            if (number > high[k]) high[k] = number;
        }
    }
    return Math.max(...low.map((least, k) => high[k] - least));
}

/** @param {Parsed} parsed @param {string} name */
function demandNormals({vertices, normals}, name) {
    demand(vertices.length, "the mesh is empty; a shape needs triangles, or points with normals");
    const hasNormals = normals?.some((c) => c !== 0);
    demand(hasNormals, `a point cloud without normals; train it with: mplicits train ${shownName(name)}`);
}

/** Returns a line that says what was read.
 * @param {Parsed} parsed @param {{vertices: Float64Array}} shape @param {ShapeColors | null} colors */
function summary({faces, meshes = 1}, {vertices}, colors) {
    /** @param {number} number @param {string} name */
    const count = (number, name) => `${number.toLocaleString("en")} ${name}`;
    const parts = meshes > 1 ? [count(meshes, "meshes")] : [];
    parts.push(faces.length ? count(faces.length / 3, "triangles") : count(vertices.length / 3, "points with normals"));
    const images = new Set(colors?.materials.flatMap(({image}) => image ?? [])), [image] = images;
    if (images.size > 1) parts.push(count(images.size, "textures"));
    else if (images.size) parts.push(`texture ${image.width} x ${image.height}`);
    if (colors?.vertex) parts.push(`colors of ${faces.length ? "vertices" : "points"}`);
    else if (colors && !images.size) parts.push("colors of materials");
    return parts.join(", ");
}
