import {demand} from "./mesh_parts.js";

// Reads the triangles of a binary glTF 2.0 file, placed by its nodes.
const MAGIC = 0x46546c67, JSON_CHUNK = 0x4e4f534a, TRIANGLES = 4;
const COMPONENTS = {5121: [1, "getUint8"], 5123: [2, "getUint16"], 5125: [4, "getUint32"], 5126: [4, "getFloat32"]};
const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

export function parseGlb(buffer) {
    const {gltf, binary} = chunks(buffer), vertices = [], faces = [];
    const add = (primitive, matrix) => {
        if ((primitive.mode ?? TRIANGLES) !== TRIANGLES) return;
        const points = accessor(gltf, binary, primitive.attributes?.POSITION, 3), first = vertices.length / 3;
        for (let i = 0; i < points.length; i += 3) vertices.push(...moved(matrix, points.slice(i, i + 3)));
        const count = points.length / 3;
        const index = primitive.indices === undefined
            ? Array.from({length: count}, (_, i) => i) : accessor(gltf, binary, primitive.indices, 1);
        for (let i = 0; i + 2 < index.length; i += 3) for (let k = 0; k < 3; ++k) faces.push(first + index[i + k]);
    };
    const visited = new Set(); // a node has one parent at most
    const visit = (index, above) => {
        const node = gltf.nodes?.[index];
        demand(node && !visited.has(index), "its nodes are damaged");
        visited.add(index);
        const matrix = matrixProduct(above, node.matrix ?? matrixOf(node));
        for (const primitive of gltf.meshes?.[node.mesh]?.primitives ?? []) add(primitive, matrix);
        for (const child of node.children ?? []) visit(child, matrix);
    };
    for (const root of gltf.scenes?.[gltf.scene ?? 0]?.nodes ?? []) visit(root, IDENTITY);
    return {vertices: Float64Array.from(vertices), faces: Uint32Array.from(faces)};
}

function chunks(buffer) {
    const view = new DataView(buffer);
    demand(buffer.byteLength >= 20 && view.getUint32(0, true) === MAGIC, "not a GLB file, or a damaged one");
    const length = view.getUint32(12, true), start = 20 + length;
    let gltf = null;
    if (view.getUint32(16, true) === JSON_CHUNK) {
        try {
            gltf = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
        } catch { /* the next line reports it */ }
    }
    demand(typeof gltf === "object" && gltf !== null, "its JSON is damaged");
    const needed = String(gltf.extensionsRequired ?? "").slice(0, 40);
    demand(!needed, `it needs the extension ${needed}; export it without compression`);
    const size = start + 8 <= buffer.byteLength ? view.getUint32(start, true) : 0;
    return {gltf, binary: new DataView(buffer, Math.min(start + 8, buffer.byteLength), size)};
}

// Returns the numbers of an accessor with `width` components.
function accessor(gltf, binary, index, width) {
    const {bufferView, componentType, count, byteOffset = 0} = gltf.accessors?.[index] ?? {};
    const view = gltf.bufferViews?.[bufferView];
    demand(view && !view.buffer && Object.hasOwn(COMPONENTS, componentType), "an accessor is damaged");
    const [size, get] = COMPONENTS[componentType], stride = view.byteStride ?? width * size, values = [];
    const start = (view.byteOffset ?? 0) + byteOffset, end = start + stride * (count - 1) + width * size;
    demand(count >= 0 && stride > 0 && end <= binary.byteLength, "an accessor is damaged");
    for (let i = 0; i < count; ++i) {
        for (let k = 0; k < width; ++k) values.push(binary[get](start + stride * i + size * k, true));
    }
    return values;
}

function matrixProduct(a, b) { // of column-major matrices
    return IDENTITY.map((_, i) => [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + i % 4] * b[4 * (i >> 2) + k], 0));
}

function moved(m, [x, y, z]) {
    return [0, 1, 2].map((i) => m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i]);
}

function matrixOf({translation: t = [0, 0, 0], rotation: [x, y, z, w] = [0, 0, 0, 1], scale: [a, b, c] = [1, 1, 1]}) {
    return [
        a * (1 - 2 * (y * y + z * z)), 2 * a * (x * y + z * w), 2 * a * (x * z - y * w), 0,
        2 * b * (x * y - z * w), b * (1 - 2 * (x * x + z * z)), 2 * b * (y * z + x * w), 0,
        2 * c * (x * z + y * w), 2 * c * (y * z - x * w), c * (1 - 2 * (x * x + y * y)), 0,
        ...t, 1,
    ];
}
