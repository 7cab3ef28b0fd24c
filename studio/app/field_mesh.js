import {isosurface} from "./isosurface.js";
import {GRADIENT, INPUTS, SAMPLE, VALUE} from "./kernel.js";

// The surface of a trained model as a mesh in the space of the shape's file.
const FIELD_BLOCK = 4096; // samples that the kernel evaluates at once
const IN_FILE = { // the inverse of `upright` in model/orientation.py
    y: (x, y, z) => [x, y, z], z: (x, y, z) => [x, -z, y], x: (x, y, z) => [y, -x, z],
    "-y": (x, y, z) => [x, -y, -z], "-z": (x, y, z) => [x, z, -y], "-x": (x, y, z) => [-y, x, z],
};

// levels: [{network, weights, delta}]; texture: {network, weights}, or null; place: {center, scale, up} of the model.
// Returns {vertices, normals, faces} of isosurface(), and colors: Float32Array (3 V), sRGB in [0, 1], or null.
export function fieldMesh(kernel, levels, texture, resolution, place) {
    const margin = 4 / resolution; // beyond the bands: a cell's corners may lie outside
    const {vertices, normals, faces} = isosurface((rows) => nestedField(kernel, levels, rows, margin), resolution,
        levels.length > 1 ? levels[0].delta : 0);
    const colors = texture && colorsAt(kernel, texture, vertices), turned = IN_FILE[place.up ?? "y"];
    for (let i = 0; i < vertices.length; i += 3) {
        const point = vertices.subarray(i, i + 3), normal = normals.subarray(i, i + 3);
        point.set(turned(...place.center.map((c, k) => point[k] * place.scale + c)));
        normal.set(turned(...normal));
    }
    return {vertices, normals, faces, colors};
}

// Fills value and gradient of rows by the finest level that is defined there (Eq. 3).
function nestedField(kernel, levels, rows, margin) {
    const sums = rows.slice(), isDefined = new Uint8Array(rows.length / SAMPLE).fill(1);
    for (const {network, weights, delta} of levels) {
        addNetwork(kernel, network, weights, sums);
        for (let i = 0, at = 0; at < rows.length; ++i, at += SAMPLE) {
            if (!isDefined[i]) continue;
            rows.set(sums.subarray(at + VALUE, at + GRADIENT + 3), at + VALUE);
            if (!(Math.abs(sums[at + VALUE]) < delta + margin)) isDefined[i] = 0;
        }
    }
}

function addNetwork(kernel, network, weights, rows) {
    kernel.prepare(network, FIELD_BLOCK);
    kernel.weights.set(weights);
    kernel.addField(rows);
}

function colorsAt(kernel, {network, weights}, vertices) {
    const rows = new Float32Array(vertices.length / 3 * SAMPLE), colors = new Float32Array(vertices.length);
    for (let i = 0, at = 0; i < vertices.length; i += 3, at += SAMPLE) rows.set(vertices.subarray(i, i + 3), at);
    addNetwork(kernel, network, weights, rows);
    return colors.map((_, i) => Math.min(Math.max(rows[SAMPLE * Math.floor(i / 3) + INPUTS + i % 3], 0), 1));
}
