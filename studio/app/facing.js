import {demand, firstNumbers} from "./mesh_parts.js";

// Turns the faces of a mesh outwards, as the Python trainer does (trainer/shapes/mesh.py).

// Reverses faces that point inwards, and their corners' texture coordinates, in place. shape: of readShape(), with
// vertices around the origin. Returns notes for the visitor. Throws MeshError if no face has an area.
export function faceOutwards({vertices, faces, colors}) {
    const notes = [];
    if (volumeOf(vertices, faces) < 0) {
        reverse(faces, 1);
        if (colors?.uv) reverse(colors.uv, 2);
        notes.push("the faces point inwards; reversed");
    }
    if (!isClosed(faces, vertices.length / 3)) {
        notes.push("the mesh is not watertight; inside is where its winding number exceeds 1/2");
    }
    return notes;
}

// Returns six times the volume that faces enclose; it is negative if they point inwards.
function volumeOf(v, faces) {
    let volume = 0, area = 0;
    for (let i = 0; i < faces.length; i += 3) {
        const a = 3 * faces[i], b = 3 * faces[i + 1], c = 3 * faces[i + 2], x = v[a], y = v[a + 1], z = v[a + 2];
        const ux = v[b] - x, uy = v[b + 1] - y, uz = v[b + 2] - z, wx = v[c] - x, wy = v[c + 1] - y, wz = v[c + 2] - z;
        const nx = uy * wz - uz * wy, ny = uz * wx - ux * wz, nz = ux * wy - uy * wx;
        volume += x * nx + y * ny + z * nz;
        area += nx * nx + ny * ny + nz * nz;
    }
    demand(area > 0, "every triangle has zero area; nothing to train on");
    return volume;
}

// Swaps the first and the last corner of each face. size: numbers of a corner.
function reverse(values, size) {
    for (let i = 0; i < values.length; i += 3 * size) {
        for (let k = 0; k < size; ++k) {
            const first = values[i + k];
            values[i + k] = values[i + 2 * size + k];
            values[i + 2 * size + k] = first;
        }
    }
}

// Returns whether every edge belongs to exactly two faces.
function isClosed(faces, count) {
    const edges = faces.length, low = new Uint32Array(edges), high = new Uint32Array(edges);
    for (let i = 0; i < edges; ++i) {
        const a = faces[i], b = faces[i % 3 < 2 ? i + 1 : i - 2];
        low[i] = a < b ? a : b;
        high[i] = a < b ? b : a;
    }
    const order = sortedBy(low, sortedBy(high, firstNumbers(Uint32Array, edges), count), count);
    const isSame = (i) => low[order[i]] === low[order[i - 1]] && high[order[i]] === high[order[i - 1]];
    for (let i = 1; i < edges; ++i) if (isSame(i) !== (i % 2 === 1)) return false;
    return edges % 2 === 0;
}

// Returns an order of keys, sorted by keys below `count`; equal ones stay in their order.
function sortedBy(keys, order, count) {
    const starts = new Uint32Array(count + 1), sorted = new Uint32Array(order.length);
    for (let i = 0; i < keys.length; ++i) ++starts[keys[i] + 1];
    for (let i = 0; i < count; ++i) starts[i + 1] += starts[i];
    for (let i = 0; i < order.length; ++i) sorted[starts[keys[order[i]]]++] = order[i];
    return sorted;
}
