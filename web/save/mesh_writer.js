import {linear} from "../read/surface_colors.js";
/** @import {fieldMesh} from "./field_mesh.js" */
/** @typedef {ReturnType<typeof fieldMesh>} Mesh */

/** Returns the bytes of a binary PLY file. @param {Mesh} mesh */
export function plyBytes({vertices, normals, faces, colors}) {
    const names = ["x", "y", "z", "nx", "ny", "nz"].map((name) => `property float ${name}\n`);
    if (colors) names.push(...["red", "green", "blue"].map((name) => `property uchar ${name}\n`));
    const count = vertices.length / 3, triangles = faces.length / 3, stride = colors ? 27 : 24;
    const head = new TextEncoder().encode(
        `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\n`
            + `${names.join("")}element face ${triangles}\nproperty list uchar int vertex_indices\nend_header\n`,
    );
    const body = head.length + stride * count, file = new Uint8Array(body + 13 * triangles);
    const view = new DataView(file.buffer);
    file.set(head);
    for (let i = 0, at = head.length; i < count; ++i, at += stride) {
        for (let k = 0; k < 3; ++k) {
            view.setFloat32(at + 4 * k, vertices[3 * i + k], true);
            view.setFloat32(at + 12 + 4 * k, normals[3 * i + k], true);
            if (colors) file[at + 24 + k] = Math.round(255 * colors[3 * i + k]);
        }
    }
    for (let i = 0, at = body; i < triangles; ++i, at += 13) {
        file[at] = 3;
        for (let k = 0; k < 3; ++k) view.setInt32(at + 1 + 4 * k, faces[3 * i + k], true);
    }
    return file;
}

/** Returns the bytes of a binary glTF 2.0 file. @param {Mesh} mesh */
export function glbBytes({vertices, normals, faces, colors}) {
    /** @type {(Float32Array | Uint32Array | Uint8Array)[]} */
    const parts = [vertices, normals, faces], count = vertices.length / 3;
    if (colors)
        parts.push(Uint8Array.from({length: 4 * count}, (_, i) => (
            i % 4 === 3 ? 255 : Math.round(255 * linear(colors[3 * (i >> 2) + i % 4]))
        )));
    let end = 0;
    const bufferViews = parts.map((part) => (
        {buffer: 0, byteOffset: (end += part.byteLength) - part.byteLength, byteLength: part.byteLength}
    ));
    const [min, max] = [Math.min, Math.max].map((choose) => [0, 1, 2].map((k) => extreme(vertices, k, choose)));
    const accessors = [
        {bufferView: 0, componentType: 5126, type: "VEC3", count, min, max},
        {bufferView: 1, componentType: 5126, type: "VEC3", count},
        {bufferView: 2, componentType: 5125, type: "SCALAR", count: faces.length},
        {bufferView: 3, componentType: 5121, type: "VEC4", count, normalized: true},
    ].slice(0, parts.length);
    const attributes = {POSITION: 0, NORMAL: 1, ...(colors && {COLOR_0: 3})};
    const text = new TextEncoder().encode(JSON.stringify({
        asset: {version: "2.0"},
        scene: 0,
        scenes: [{nodes: [0]}],
        nodes: [{mesh: 0}],
        meshes: [{primitives: [{attributes, indices: 2}]}],
        accessors,
        bufferViews,
        buffers: [{byteLength: end}],
    }));
    const binary = 20 + 4 * Math.ceil(text.length / 4) + 8, file = new Uint8Array(binary + end).fill(32, 20, binary);
    file.set(text, 20);
    new Uint32Array(file.buffer, 0, 5).set([0x46546c67, 2, file.length, binary - 28, 0x4e4f534a]);
    new Uint32Array(file.buffer, binary - 8, 2).set([end, 0x004e4942]);
    parts.forEach((part, i) => {
        file.set(new Uint8Array(part.buffer, part.byteOffset, part.byteLength), binary + bufferViews[i].byteOffset);
    });
    return file;
}

/** @param {Float32Array} vertices @param {number} k @param {(a: number, b: number) => number} choose */
function extreme(vertices, k, choose) {
    let found = vertices[k];
    for (let i = k; i < vertices.length; i += 3) found = choose(found, vertices[i]);
    return found;
}
