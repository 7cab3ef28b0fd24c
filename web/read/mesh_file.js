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

// Reads a shape from a file and the files beside it.
const PARSERS = {obj: parseObj, ply: parsePly, stl: parseStl, glb: parseGlb, gltf: parseGlb, xyz: parseXyz};
const MOST_BYTES = 2 ** 29, MOST_NOTES = 8;

// Reads the shape of files that were dropped together: [{name, path, bytes: ArrayBuffer}]. Throws MeshError. Returns
// {name: of its file, vertices: Float64Array (3 V), faces: Uint32Array (3 F), normals, cloudNormals: unit vectors of a
// cloud, which has no faces, Float64Array (3 V), or null; colors, notes: lines for the visitor, up: "y" or null}.
// Vertices at one place are one vertex, and polygons are triangles. normals is null or those of the file at the corners
// of faces, {values: Float64Array (3 N) of any length, index: (3 F)}. colors is null or {vertex: (3 V) or null, uv:
// Float32Array (6 F) at the corners of faces or null, material: Uint16Array (F), or null where all faces have the
// first, materials: [{color: [r, g, b], image: {width, height, pixels: RGBA} or null}]}; colors are sRGB in [0, 1].
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
    const shape = isCloud ? cleanCloud(parsed) : mergedMesh(parsed);
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

// Returns what the format's reader returns: {vertices: Float64Array, faces: Uint32Array; normals: Float64Array (of
// vertices), or of the corners by their indices normalOf; tints: Float32Array (of vertices); uv: Float32Array (of
// corners), material: Uint16Array (of faces), materials: [{color, image: {name, bytes}}], where a missing color, image
// or bytes is null; isProduct: whether tints, colors and images multiply; notes; meshes: their number}. All but vertices
// and faces may be missing. Its indices are not checked.
// find: returns the bytes of a file by its name, or null.
function parsedShape(name, buffer, find) {
    const ending = endingOf(name);
    demand(Object.hasOwn(PARSERS, ending), "not a mesh or a cloud that this page reads: OBJ, PLY, STL, GLB or XYZ");
    demand(buffer.byteLength <= MOST_BYTES, `over 512 MB; train it with: mplicits train ${shownName(name)}`);
    try {
        return PARSERS[ending](new Uint8Array(buffer), find);
    } catch (error) {
        if (error instanceof MeshError) throw error;
        throw new MeshError("the file is cut short or damaged", {cause: error});
    }
}

const endingOf = (name) => name.slice(name.lastIndexOf(".") + 1).toLowerCase();

// Returns a function that finds a file by a name in another one: by its path, or else by its base name; or else, where
// it is the only one, by its ending.
function finderOf(files) {
    const plain = (path) => path.replaceAll("\\", "/").replace(/^(\.?\/)+/, "").toLowerCase();
    return (asked, ending = null) => {
        const path = plain(asked), base = path.slice(path.lastIndexOf("/") + 1);
        const same = files.filter(({name}) => name.toLowerCase() === base);
        const alike = same.length || !ending ? [] : files.filter(({name}) => ending.test(name));
        const found = same.find((file) => `/${plain(file.path ?? file.name)}`.endsWith(`/${path}`)) ?? same[0];
        const only = found ?? (alike.length === 1 ? alike[0] : null);
        return only && new Uint8Array(only.bytes);
    };
}

// Merges vertices at one place; the first keeps its color. Writes the new indices to faces.
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
                if (tints) colors[3 * kept + k] = tints[3 * from + k];
            }
            numbers[from] = ++kept;
        }
        faces[i] = numbers[from] - 1;
    }
    return {vertices: points.slice(0, 3 * kept), tints: colors && colors.slice(0, 3 * kept)};
}

// Returns the longest side of the box around the vertices of faces.
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

function demandNormals({vertices, normals}, name) {
    demand(vertices.length, "the mesh is empty; a shape needs triangles, or points with normals");
    const hasNormals = normals?.some((c) => c !== 0);
    demand(hasNormals, `a point cloud without normals; train it with: mplicits train ${shownName(name)}`);
}

// Returns a line that says what was read.
function summary({faces, meshes = 1}, {vertices}, colors) {
    const count = (number, name) => `${number.toLocaleString("en")} ${name}`;
    const parts = meshes > 1 ? [count(meshes, "meshes")] : [];
    parts.push(faces.length ? count(faces.length / 3, "triangles") : count(vertices.length / 3, "points with normals"));
    const images = new Set(colors?.materials.map(({image}) => image).filter(Boolean)), [{width, height} = {}] = images;
    if (images.size > 1) parts.push(count(images.size, "textures"));
    else if (images.size) parts.push(`texture ${width} x ${height}`);
    if (colors?.vertex) parts.push(`colors of ${faces.length ? "vertices" : "points"}`);
    else if (colors && !images.size) parts.push("colors of materials");
    return parts.join(", ");
}
