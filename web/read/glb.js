import {openGltf} from "./gltf_data.js";
import {materialOf} from "./gltf_materials.js";
import {IDENTITY, isMirror, matrixOf, matrixProduct, normalMatrix} from "./matrices.js";
import {demand, demandFew, firstNumbers, Growing} from "./mesh_parts.js";
import {encoded} from "./surface_colors.js";
/** @import {Gltf, GltfFile, GltfNode, Primitive, Skin} from "./gltf_data.js" */
/** @import {Matrix} from "./matrices.js" */
/** @import {Find, Parsed} from "./mesh_file.js" */

// Reads the triangles, normals and colors of a glTF 2.0 file, placed by its nodes and by skins in their pose.
const TRIANGLES = 4, STRIP = 5, FAN = 6, MOST_INSTANCES = 100_000;

/** @param {Uint8Array} bytes @param {Find} find @returns {Parsed} */
export function parseGlb(bytes, find) {
    const file = openGltf(bytes, find), {gltf, accessor} = file, placed = placedNodes(gltf);
    const skins = /** @type {Map<Skin, Matrix[]>} */ (new Map());
    const points = new Growing(Float64Array), normals = new Growing(Float64Array);
    const tints = new Growing(Float32Array), uv = new Growing(Float32Array);
    const faces = new Growing(Uint32Array), material = new Growing(Uint16Array), materials = new Map();
    let meshes = 0;

    /** @param {Primitive} primitive @param {(i: number) => Matrix} matrices
     * @param {ReturnType<typeof skinWeights>} weights */
    function add(primitive, matrices, weights) {
        const {attributes = {}, mode = TRIANGLES, indices, material: name} = primitive;
        if (![TRIANGLES, STRIP, FAN].includes(mode)) return;
        const {numbers: own} = accessor(attributes.POSITION, ["VEC3"]), count = own.length / 3, first = points.size / 3;
        const order = indices === undefined ? firstNumbers(Float64Array, count) : accessor(indices, ["SCALAR"]).numbers;
        const corners = triangles(order, mode, isMirror(matrices(0)));
        if (!materials.has(name)) materials.set(name, {...materialOf(file, name), index: materials.size});
        const {index, coordinates, transform} = materials.get(name);
        demandFew((faces.size + corners.length) / 3, "triangles");
        demandFew((points.size / 3 + count) / 3, "triangles");
        const {NORMAL} = attributes;
        const directions = NORMAL === undefined ? null : accessor(NORMAL, ["VEC3"], count).numbers;
        placePoints({points, normals}, own, directions, matrices, weights);
        if (attributes.COLOR_0 !== undefined) {
            const {numbers, width} = accessor(attributes.COLOR_0, ["VEC3", "VEC4"], count, true);
            tints.fill(1, 3 * first);
            for (let i = 0; i < numbers.length; i += width) {
                for (let k = 0; k < 3; ++k) tints.push(encoded(numbers[i + k]));
            }
        }
        const uvIndex = attributes[`TEXCOORD_${coordinates}`];
        const table = uvIndex === undefined ? null : accessor(uvIndex, ["VEC2"], count).numbers;
        if (table) uv.fill(0, 2 * faces.size);
        for (const corner of corners) {
            demand(corner < count, "a face names a vertex that does not exist");
            faces.push(first + corner);
            if (table) { for (const c of transform(table[2 * corner], table[2 * corner + 1])) uv.push(c); }
        }
        material.fill(index, faces.size / 3);
    }

    for (const [index, matrix] of placed) {
        const node = gltf.nodes[index], primitives = gltf.meshes?.[node.mesh]?.primitives ?? [];
        const joints = gltf.skins?.[node.skin];
        if (joints && !skins.has(joints)) skins.set(joints, jointMatrices(joints, placed, accessor));
        for (const instance of instances(node, matrix, accessor)) {
            meshes += primitives.length ? 1 : 0;
            for (const primitive of primitives) {
                /** @type {(i: number) => Matrix} */
                const matrices = joints ? (i) => skins.get(joints)?.[i] ?? IDENTITY : () => instance;
                add(primitive, matrices, joints ? skinWeights(primitive, accessor) : null);
            }
        }
    }
    if (tints.size) tints.fill(1, points.size);
    if (uv.size) uv.fill(0, 2 * faces.size);
    return {
        vertices: points.filled,
        faces: faces.filled,
        tints: tints.size ? tints.filled : null,
        normals: normals.size === points.size ? normals.filled : null,
        uv: uv.size ? uv.filled : null,
        material: material.filled,
        materials: [...materials.values()],
        isProduct: true,
        meshes,
    };
}

/** Returns a node's index -> its matrix, of the nodes of the scene.
 * @param {Gltf} gltf @returns {Map<number, Matrix>} */
function placedNodes({scenes, scene = 0, nodes}) {
    const placed = new Map();
    /** @type {[number, Matrix][]} */
    const pending = Array.from(scenes?.[scene]?.nodes ?? [], (index) => [index, IDENTITY]);
    for (let next = pending.pop(); next; next = pending.pop()) {
        const [index, above] = next, node = nodes?.[index];
        demand(node && !placed.has(index), "its nodes are damaged"); // a node has one parent at most
        const matrix = matrixProduct(above, node.matrix ?? matrixOf(node));
        placed.set(index, matrix);
        for (const child of node.children ?? []) pending.push([child, matrix]);
    }
    return placed;
}

/** Returns the matrices of a node's instances.
 * @param {GltfNode} node @param {Matrix} matrix @param {GltfFile["accessor"]} accessor */
function instances({extensions}, matrix, accessor) {
    const {TRANSLATION, ROTATION, SCALE} = extensions?.EXT_mesh_gpu_instancing?.attributes ?? {};
    if ((TRANSLATION ?? ROTATION ?? SCALE) === undefined) return [matrix];
    /** @param {number | undefined} index @param {string} type */
    const read = (index, type) => (index === undefined ? null : accessor(index, [type]).numbers);
    const translations = read(TRANSLATION, "VEC3"), rotations = read(ROTATION, "VEC4"), scales = read(SCALE, "VEC3");
    const count = translations ? translations.length / 3 : rotations ? rotations.length / 4 : (scales?.length ?? 0) / 3;
    demand(count <= MOST_INSTANCES, "too many instances");
    return Array.from({length: count}, (_, i) =>
        matrixProduct(
            matrix,
            matrixOf({
                translation: translations?.subarray(3 * i, 3 * i + 3),
                rotation: rotations?.subarray(4 * i, 4 * i + 4),
                scale: scales?.subarray(3 * i, 3 * i + 3),
            }),
        ));
}

/** Returns the matrices of a skin's joints, from the mesh to the scene.
 * @param {Skin} skin @param {Map<number, Matrix>} placed @param {GltfFile["accessor"]} accessor */
function jointMatrices({joints, inverseBindMatrices}, placed, accessor) {
    const inverse = inverseBindMatrices === undefined ? null : accessor(inverseBindMatrices, ["MAT4"]).numbers;
    return joints.map((joint, i) => {
        const world = placed.get(joint) ?? IDENTITY;
        return inverse ? matrixProduct(world, inverse.subarray(16 * i, 16 * i + 16)) : world;
    });
}

/** @param {Primitive} primitive @param {GltfFile["accessor"]} accessor */
function skinWeights({attributes = {}}, accessor) {
    const {JOINTS_0, WEIGHTS_0} = attributes;
    if (JOINTS_0 === undefined || WEIGHTS_0 === undefined) return null;
    const {numbers: shares} = accessor(WEIGHTS_0, ["VEC4"], undefined, true);
    return {joints: accessor(JOINTS_0, ["VEC4"]).numbers, shares};
}

/** Adds points and their normals, or null, moved by a matrix; with weights, by the mean of their joints' matrices.
 * @param {Record<"points" | "normals", Growing<Float64Array>>} to @param {Float64Array} own
 * @param {Float64Array | null} directions @param {(i: number) => Matrix} matrices
 * @param {ReturnType<typeof skinWeights>} weights */
function placePoints({points, normals}, own, directions, matrices, weights) {
    const mean = new Float64Array(16);
    for (let i = 0; i < own.length / 3; ++i) {
        let m = matrices(0);
        if (weights) {
            m = mean.fill(0);
            for (let k = 4 * i; k < 4 * i + 4; ++k) {
                const share = weights.shares[k];
                if (share)
                    matrices(weights.joints[k]).forEach((c, j) => {
                        mean[j] += share * c;
                    });
            }
        }
        const x = own[3 * i], y = own[3 * i + 1], z = own[3 * i + 2];
        for (let k = 0; k < 3; ++k) points.push(m[k] * x + m[4 + k] * y + m[8 + k] * z + m[12 + k]);
        if (!directions) continue;
        const n = normalMatrix(m), sign = isMirror(m) ? -1 : 1; // outward stays outward in a mirror
        const nx = sign * directions[3 * i], ny = sign * directions[3 * i + 1], nz = sign * directions[3 * i + 2];
        for (let k = 0; k < 3; ++k) normals.push(n[k] * nx + n[3 + k] * ny + n[6 + k] * nz);
    }
}

/** Returns the corners of triangles.
 * @param {Float64Array} order indices of vertices @param {number} mode @param {boolean} isMirrored */
function triangles(order, mode, isMirrored) {
    const count = mode === TRIANGLES ? Math.floor(order.length / 3) : Math.max(0, order.length - 2);
    if (mode === TRIANGLES && !isMirrored) return order.subarray(0, 3 * count);
    const corners = new Float64Array(3 * count);
    for (let i = 0; i < count; ++i) {
        const isTurned = mode === STRIP && i % 2 === 1, first = mode === TRIANGLES ? 3 * i : i;
        const three = [mode === FAN ? 0 : first, first + 1, first + 2];
        if (isTurned !== isMirrored) three.reverse();
        for (let k = 0; k < 3; ++k) corners[3 * i + k] = order[three[k]];
    }
    return corners;
}
