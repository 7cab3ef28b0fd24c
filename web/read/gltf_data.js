import {numberAt, SIZES, viewOf} from "./binary.js";
import {demand, demandFew, shownName} from "./mesh_parts.js";
/** @import {NumberType} from "./binary.js" */
/** @import {Find} from "./mesh_file.js" */

/** What is read of a file's JSON. Any part may be missing.
 * @typedef {{buffer: number, byteOffset?: number, byteLength: number, byteStride?: number}} BufferView
 * @typedef {{bufferView?: number, uri?: string}} Source
 * @typedef {Source & {byteOffset?: number, componentType: number}} Sparse
 * @typedef {{componentType: number, count: number, type: string, bufferView?: number, byteOffset?: number,
 *     normalized?: boolean, sparse?: {count: number, indices: Sparse, values: Sparse}}} Accessor
 * @typedef {{attributes?: Record<string, number>, mode?: number, indices?: number, material: number}} Primitive
 * @typedef {{mesh: number, skin: number, children?: number[], matrix?: number[], translation?: number[],
 *     rotation?: number[], scale?: number[],
 *     extensions?: {EXT_mesh_gpu_instancing?: {attributes?: Record<string, number>}}}} GltfNode
 * @typedef {{joints: number[], inverseBindMatrices?: number}} Skin
 * @typedef {{index: number, texCoord?: number, extensions?: {KHR_texture_transform?:
 *     {offset?: number[], rotation?: number, scale?: number[], texCoord?: number}}}} TextureInfo
 * @typedef {{pbrMetallicRoughness?: {baseColorFactor?: number[], baseColorTexture?: TextureInfo},
 *     extensions?: {KHR_materials_pbrSpecularGlossiness?: {diffuseFactor?: number[], diffuseTexture?: TextureInfo}}
 *     }} GltfMaterial
 * @typedef {{extensionsRequired?: string[], scene?: number, scenes?: {nodes?: number[]}[], nodes: GltfNode[],
 *     meshes: {primitives?: Primitive[]}[], skins?: Skin[], accessors: Accessor[], bufferViews: BufferView[],
 *     buffers: {uri?: string}[], materials: GltfMaterial[], images: (Source & {name?: string})[],
 *     textures: {source?: number, extensions?: Record<string, {source?: number}>}[]}} Gltf
 * @typedef {ReturnType<typeof openGltf>} GltfFile */

// The JSON and the numbers of a glTF 2.0 file, binary (GLB) or text with other files.
const MAGIC = 0x46546c67; // "glTF"
/** @type {Record<number, NumberType>} */
const COMPONENTS = {5120: "int8", 5121: "uint8", 5122: "int16", 5123: "uint16", 5125: "uint32", 5126: "float32"};
/** @type {Record<string, number>} */
const WIDTHS = {SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16};
// Extensions that a file may require: those that are read, and those that change no shape.
const KNOWN = RegExp(
    "^(KHR_(mesh_quantization|texture_transform|texture_basisu|materials_\\w+|lights_\\w+)|"
        + "EXT_(mesh_gpu_instancing|texture_webp))$",
);

/** Returns the JSON, and functions that read from it. @param {Uint8Array} bytes @param {Find} find */
export function openGltf(bytes, find) {
    const {gltf, binary} = chunksOf(bytes);
    const [unknown] = (gltf.extensionsRequired ?? []).filter((name) => !KNOWN.test(name)).map(shownName);
    demand(unknown === undefined, `it needs the extension ${unknown}; export it without compression`);

    /** Returns the bytes of a buffer view, or of a file or URL that an object names; null where they are missing.
     * @param {Source} source */
    function dataOf({bufferView, uri}) {
        if (bufferView === undefined) return uri === undefined ? null : resourceOf(String(uri), find);
        const {buffer, byteOffset = 0, byteLength} = gltf.bufferViews[bufferView];
        const {uri: file} = gltf.buffers?.[buffer] ?? {};
        const whole = file === undefined ? binary : resourceOf(String(file), find);
        demand(whole, `the file ${shownName(file)} is missing; drop the whole folder`);
        demand(byteOffset >= 0 && byteOffset + byteLength <= whole.length, "a buffer is cut short");
        return whole.subarray(byteOffset, byteOffset + byteLength);
    }

    /** Returns the numbers of an accessor (width x count). isColor: integers are shares of the largest.
     * @param {number} index @param {string[]} types that are allowed @param {number} [expected] the right count */
    function accessor(index, types, expected, isColor = false) {
        const found = gltf.accessors?.[index] ?? {}, {componentType, count, type} = found;
        const {bufferView, byteOffset = 0, normalized, sparse} = found;
        demand(types.includes(type) && Object.hasOwn(COMPONENTS, componentType), "an accessor is damaged");
        demand(Number.isInteger(count) && count >= 0 && count === (expected ?? count), "an accessor's count is wrong");
        demandFew(count / 6, "triangles");
        const component = COMPONENTS[componentType], width = WIDTHS[type], numbers = new Float64Array(width * count);
        if (bufferView !== undefined) {
            const {byteStride = width * SIZES[component]} = gltf.bufferViews[bufferView];
            fill(numbers, width, dataOf({bufferView}), component, byteOffset, byteStride);
        }
        if (sparse) replace(numbers, width, component, sparse);
        if ((normalized || isColor) && component !== "float32") {
            const most = 2 ** (8 * SIZES[component] - (component.startsWith("u") ? 0 : 1)) - 1;
            for (let i = 0; i < numbers.length; ++i) numbers[i] = Math.max(-1, numbers[i] / most);
        }
        return {numbers, width};
    }

    /** @param {Float64Array} numbers @param {number} width @param {NumberType} component
     * @param {NonNullable<Accessor["sparse"]>} sparse */
    function replace(numbers, width, component, {count, indices, values}) {
        demand(count >= 0 && width * count <= numbers.length, "an accessor is damaged");
        const places = new Float64Array(count), others = new Float64Array(width * count);
        const type = COMPONENTS[indices.componentType];
        fill(places, 1, dataOf(indices), type, indices.byteOffset ?? 0, SIZES[type]);
        fill(others, width, dataOf(values), component, values.byteOffset ?? 0, width * SIZES[component]);
        places.forEach((place, i) => numbers.set(others.subarray(width * i, width * (i + 1)), width * place));
    }

    return {gltf, accessor, dataOf};
}

/** Fills an array of rows of numbers from bytes. @param {Float64Array} numbers @param {number} width
 * @param {Uint8Array | null} bytes @param {NumberType} component @param {number} start @param {number} stride */
function fill(numbers, width, bytes, component, start, stride) {
    demand(bytes && stride > 0 && start >= 0, "an accessor is damaged");
    const view = viewOf(bytes), size = SIZES[component];
    for (let i = 0, at = start; i < numbers.length; at += stride) {
        for (let k = 0; k < width; ++k) numbers[i++] = numberAt(view, component, at + size * k, true);
    }
}

/** @param {string} uri @param {Find} find */
function resourceOf(uri, find) {
    const [, isBase64, data] = /^data:[^,]*?(;base64)?,(.*)$/s.exec(uri) ?? [];
    if (data === undefined) return find(decodeURIComponent(uri));
    return isBase64 ? Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0)) : null;
}

/** @param {Uint8Array} bytes @returns {{gltf: Gltf, binary: Uint8Array | null}} */
function chunksOf(bytes) {
    const view = viewOf(bytes), isBinary = bytes.length >= 20 && view.getUint32(0, true) === MAGIC;
    let text = bytes, binary = null;
    if (isBinary) {
        const length = view.getUint32(12, true), start = 20 + length;
        text = bytes.subarray(20, start);
        if (start + 8 <= bytes.length) binary = bytes.subarray(start + 8, start + 8 + view.getUint32(start, true));
    }
    let gltf = null;
    try {
        gltf = JSON.parse(new TextDecoder().decode(text));
    } catch { /* the next line reports it */ }
    demand(typeof gltf === "object" && gltf !== null, "not a glTF file, or a damaged one");
    return {gltf, binary};
}
