/** @import {CornerNormals, Picture, ReadShape} from "../read/mesh_file.js" */

/** The buffers of a preview of N corners: colors (4 N), sRGB; places (2 N) of texture coordinates; parts: ranges of the
 * corners with one image.
 * @typedef {{first: number, count: number, image?: Picture | null, color?: number[]}} PreviewPart
 * @typedef {{positions: Float32Array, normals: Int8Array, colors: Uint8Array, places: Float32Array | null,
 *     parts: PreviewPart[], isCloud: boolean}} PreviewBuffers */

/** Makes the buffers of a preview of a shape in model space, in a worker. @param {ReadShape} shape
 * @param {CornerNormals | null} corners normals of its faces' corners, null for a cloud
 * @param {Vector} plain color of a shape without colors, sRGB @returns {PreviewBuffers} */
export function cornersOf({vertices, faces, cloudNormals, colors}, corners, plain) {
    const isCloud = !faces.length, count = isCloud ? vertices.length / 3 : faces.length;
    const order = isCloud ? null : inMaterialOrder(faces.length / 3, colors?.material);
    const cornerOf = (/** @type {number} */ i) => (order ? 3 * order[Math.floor(i / 3)] + i % 3 : i);
    const {values, index} = corners ?? /** @type {CornerNormals} */ ({values: cloudNormals});
    const {uv = null, vertex = null, materials = []} = colors ?? {};
    const result = {
        positions: new Float32Array(3 * count),
        normals: new Int8Array(4 * count),
        colors: new Uint8Array(4 * count),
        places: uv && new Float32Array(2 * count),
        parts: /** @type {(PreviewPart & {material: unknown})[]} */ ([]),
        isCloud,
    };
    for (let i = 0; i < count; ++i) {
        const corner = isCloud ? i : cornerOf(i),
            v = 3 * (isCloud ? i : faces[corner]),
            n = isCloud ? v : 3 * index[corner];
        const material = materials[colors?.material?.[Math.floor(corner / 3)] ?? 0];
        for (let k = 0; k < 3; ++k) {
            result.positions[3 * i + k] = vertices[v + k];
            result.normals[4 * i + k] = Math.round(127 * values[n + k]);
            result.colors[4 * i + k] = Math.round(255 * (vertex ? vertex[v + k] : (material?.color ?? plain)[k]));
        }
        if (uv) result.places?.set(uv.subarray(2 * corner, 2 * corner + 2), 2 * i);
        const last = result.parts.at(-1);
        if (last && last.material === material) ++last.count;
        else result.parts.push({first: i, count: 1, material, image: uv && material?.image, color: material?.color});
    }
    return {
        ...result,
        parts: result.parts.map(({first, count: corners, image, color}) => ({first, count: corners, image, color})),
    };
}

/** Returns the faces, ordered by their materials; null if there is one material.
 * @param {number} count @param {Uint16Array | null | undefined} material */
function inMaterialOrder(count, material) {
    if (!material) return null;
    return Uint32Array.from({length: count}, (_, i) => i).sort((a, b) => material[a] - material[b] || a - b);
}
