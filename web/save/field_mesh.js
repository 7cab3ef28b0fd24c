import {INPUTS, SAMPLE} from "../kernel/kernel.js";
import {addNested, addNetwork} from "../train/nested.js";
import {isosurface} from "./isosurface.js";
/** @import {Kernel} from "../kernel/kernel_instance.js" */
/** @import {BareLevel, BareNetwork} from "../train/nested.js" */

// The surface of a trained model as a mesh in the space of the shape's file.
const PROBE = 64; // cells of a grid that tells how many triangles a finer one gives
const COARSEST = 16, FINEST = 512;

/** Returns the resolution of a mesh of about `triangles`: their number grows with its square.
 * @param {number} triangles @param {Kernel} kernel @param {BareLevel[]} levels */
export function resolutionFor(triangles, kernel, levels) {
    const {faces} = fieldMesh(kernel, levels, null, PROBE, {center: [0, 0, 0], scale: 1});
    return Math.min(FINEST, Math.max(COARSEST, Math.round(PROBE * Math.sqrt(3 * triangles / faces.length))));
}

/** Returns the surface with colors (3 V), sRGB in [0, 1], or null.
 * @param {Kernel} kernel @param {BareLevel[]} levels @param {BareNetwork | null} texture @param {number} resolution
 * @param {{center: Vector, scale: number}} place of the model */
export function fieldMesh(kernel, levels, texture, resolution, place) {
    const margin = 4 / resolution; // beyond the bands: a cell's corners may lie outside
    const {vertices, normals, faces} = isosurface(
        (rows) => addNested(kernel, levels, rows, margin),
        resolution,
        levels.length > 1 ? levels[0].delta : 0,
    );
    const colors = texture && colorsAt(kernel, texture, vertices);
    return {vertices: vertices.map((c, i) => c * place.scale + place.center[i % 3]), normals, faces, colors};
}

/** @param {Kernel} kernel @param {BareNetwork} texture @param {Float32Array} vertices */
function colorsAt(kernel, texture, vertices) {
    const rows = new Float32Array(vertices.length / 3 * SAMPLE), colors = new Float32Array(vertices.length);
    for (let i = 0, at = 0; i < vertices.length; i += 3, at += SAMPLE) rows.set(vertices.subarray(i, i + 3), at);
    addNetwork(kernel, texture, rows);
    return colors.map((_, i) => Math.min(Math.max(rows[SAMPLE * Math.floor(i / 3) + INPUTS + i % 3], 0), 1));
}
