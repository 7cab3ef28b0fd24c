import {readShape} from "../read/mesh_file.js";
import {demand} from "../read/mesh_parts.js";
import {cornerNormals} from "./creases.js";
import {curvedFacets, flatFacets} from "./curved_surface.js";
import {EXAMPLES} from "./examples.js";
import {faceOutwards} from "./facing.js";
/** @import {InputFile, ReadShape} from "../read/mesh_file.js" */
/** @import {Facets} from "./curved_surface.js" */

// Reads the shape to train on, moves it to model space, turns its faces outwards, and curves them.

/** Input space = model space * scale + center. @typedef {ReadShape & {center: Vector, scale: number}} PlacedShape */
/** facets: null for a cloud. @typedef {PlacedShape & {facets: Facets | null}} FacetedShape */

/** Reads files, or else an example by its number, and moves it to model space. Throws MeshError.
 * @param {InputFile[] | undefined} files @param {number} example @returns {Promise<PlacedShape>} */
export async function input(files, example) {
    const read = files ? await readShape(files) : exampleShape(EXAMPLES[example]);
    const {vertices, center, scale} = normalized(read.vertices);
    const notes = read.faces.length ? faceOutwards({...read, vertices}) : [];
    return {...read, vertices, center, scale, notes: [...read.notes, ...notes]};
}

/** Adds the facets to train on to a shape of input(), and moves both to the model space of the facets: a curved surface
 * may bulge beyond its mesh. Returns also the normals of its faces' corners, null for a cloud.
 * @param {PlacedShape} read @param {number | null} crease least angle of a crease, degrees; null for flat faces */
export function withFacets(read, crease) {
    const {vertices, faces, normals, center, scale} = read;
    if (!faces.length) return {read: {...read, facets: null}, corners: null};
    const corners = crease === null ? null : cornerNormals(vertices, faces, crease, normals);
    const facets = corners ? curvedFacets(vertices, faces, corners) : flatFacets(vertices, faces);
    const moved = normalized(facets.vertices),
        place = {
            vertices: facets.cuts === 1
                ? moved.vertices
                : vertices.map((c, i) => (c - moved.center[i % 3]) / moved.scale),
            center: center.map((c, k) => c + scale * moved.center[k]),
            scale: scale * moved.scale,
        };
    return {
        read: {...read, ...place, facets: {...facets, vertices: moved.vertices}},
        corners: corners ?? {values: facets.normals, index: facets.normalOf},
    };
}

/** @param {typeof EXAMPLES[number]} example @returns {ReadShape} */
function exampleShape({name, make}) {
    const shape = make(), notes = [`${(shape.faces.length / 3).toLocaleString("en")} triangles`];
    return {name, ...shape, normals: null, cloudNormals: null, notes, up: "y"};
}

/** Moves the center of the bounding box to the origin, and scales the largest norm to 1, as normalize() in
 * trainer/shapes/shape.py. @param {Float64Array} vertices */
function normalized(vertices) {
    const least = [Infinity, Infinity, Infinity], most = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < vertices.length; ++i) {
        const k = i % 3, c = vertices[i];
        if (c < least[k]) least[k] = c;
        if (c > most[k]) most[k] = c;
    }
    const center = least.map((c, k) => (c + most[k]) / 2), moved = new Float64Array(vertices.length);
    let squared = 0;
    for (let i = 0; i < moved.length; i += 3) {
        let sum = 0;
        for (let k = 0; k < 3; ++k) {
            moved[i + k] = vertices[i + k] - center[k];
            sum += moved[i + k] ** 2;
        }
        if (sum > squared) squared = sum;
    }
    const scale = Math.sqrt(squared);
    demand(scale > 0 && scale < Infinity, "all vertices are at one place, or too far apart");
    for (let i = 0; i < moved.length; ++i) moved[i] /= scale;
    return {vertices: moved, center, scale};
}
