import {demand} from "../read/mesh_parts.js";
import {sortedEdges} from "./edges.js";
import {crossProducts} from "./face_normals.js";
/** @import {ReadShape} from "../read/mesh_file.js" */

// Turns the faces of a mesh outwards, as the Python trainer does (trainer/shapes/mesh.py).

/** Reverses faces that point inwards, and what their corners have, in place. Returns notes for the visitor. Throws
 * MeshError if no face has an area. @param {ReadShape} shape with vertices around the origin */
export function faceOutwards({vertices, faces, normals, colors}) {
    const notes = [];
    if (volumeOf(vertices, faces) < 0) {
        reverse(faces, 1);
        if (normals) reverse(normals.index, 1);
        if (colors?.uv) reverse(colors.uv, 2);
        notes.push("the faces point inwards; reversed");
    }
    if (!isClosed(faces, vertices.length / 3)) {
        notes.push("the mesh is not watertight; inside is where its winding number exceeds 1/2");
    }
    return notes;
}

/** Returns six times the volume that faces enclose; it is negative if they point inwards.
 * @param {Float64Array} v vertices @param {Uint32Array} faces */
function volumeOf(v, faces) {
    const products = crossProducts(v, faces);
    let volume = 0, area = 0;
    for (let i = 0; i < faces.length; i += 3) {
        const a = 3 * faces[i], x = products[i], y = products[i + 1], z = products[i + 2];
        volume += v[a] * x + v[a + 1] * y + v[a + 2] * z;
        area += x * x + y * y + z * z;
    }
    demand(area > 0, "every triangle has zero area; nothing to train on");
    return volume;
}

/** Swaps the first and the last corner of each face.
 * @param {Uint32Array | Int32Array | Float32Array} values @param {number} size numbers of a corner */
function reverse(values, size) {
    for (let i = 0; i < values.length; i += 3 * size) {
        for (let k = 0; k < size; ++k) {
            const first = values[i + k];
            values[i + k] = values[i + 2 * size + k];
            values[i + 2 * size + k] = first;
        }
    }
}

/** Returns whether every edge belongs to exactly two faces. @param {Uint32Array} faces @param {number} count */
function isClosed(faces, count) {
    const {order, isSame} = sortedEdges(faces, count);
    for (let i = 1; i < order.length; ++i) if (isSame(i) !== (i % 2 === 1)) return false;
    return order.length % 2 === 0;
}
