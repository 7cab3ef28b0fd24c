import {parseGlb} from "./glb.js";
import {demand, MeshError} from "./mesh_parts.js";
import {parseObj} from "./obj.js";
import {parsePly} from "./ply.js";
import {parseStl} from "./stl.js";

// Reads a mesh file.
const PARSERS = {obj: parseObj, ply: parsePly, stl: parseStl, glb: parseGlb};

// Returns {vertices: Float64Array (3 V), faces: Uint32Array (3 F)}; vertices at one place are one vertex, and polygons
// are triangles. name: of the file, whose ending names the format; buffer: its bytes. Throws MeshError.
export function parseMesh(name, buffer) {
    const ending = name.slice(name.lastIndexOf(".") + 1).toLowerCase();
    demand(Object.hasOwn(PARSERS, ending), "not a mesh that this page reads: OBJ, PLY, STL or GLB");
    try {
        return checked(merged(PARSERS[ending](buffer)));
    } catch (error) {
        if (error instanceof RangeError) throw new MeshError("the file is cut short or damaged");
        throw error;
    }
}

function checked({vertices, faces}) {
    const count = vertices.length / 3;
    demand(count && faces.length, "the mesh is empty; a shape needs triangles");
    demand(vertices.every(Number.isFinite), "has coordinates that are not finite");
    demand(faces.every((index) => index < count), "a face names a vertex that does not exist");
    return {vertices, faces};
}

// Merges vertices with the same coordinates.
function merged({vertices, faces}) {
    const count = vertices.length / 3, places = new Map(), index = new Uint32Array(count), kept = [];
    for (let i = 0; i < count; ++i) {
        const key = `${vertices[3 * i]},${vertices[3 * i + 1]},${vertices[3 * i + 2]}`;
        let place = places.get(key);
        if (place === undefined) {
            place = places.size;
            places.set(key, place);
            kept.push(i);
        }
        index[i] = place;
    }
    if (kept.length === count) return {vertices, faces};
    const few = new Float64Array(3 * kept.length);
    kept.forEach((i, place) => few.set(vertices.subarray(3 * i, 3 * i + 3), 3 * place));
    return {vertices: few, faces: faces.map((i) => (i < count ? index[i] : i))};
}

export async function readShape([{name, bytes}]) {
    const {vertices, faces} = parseMesh(name, bytes);
    return {name, vertices, faces, cloudNormals: null, colors: null, notes: [`${(faces.length / 3).toLocaleString("en")} triangles`], up: null};
}
