import {numberAt, SIZES, viewOf} from "./binary.js";
import {demand, demandFew, unitColors} from "./mesh_parts.js";
import {FaceReader, STRIPS} from "./ply_faces.js";
import {chosenProperties, colorScale, GROUPS, plyHeader} from "./ply_header.js";
import {TextReader} from "./text_reader.js";
/** @import {NumberType} from "./binary.js" */
/** @import {Find, Parsed} from "./mesh_file.js" */
/** @import {Property} from "./ply_header.js" */

// Reads a PLY file: a mesh or a cloud, text or binary in either order of bytes.

/** What vertices have. table: texture coordinates.
 * @typedef {{vertices: Float64Array, normals?: Float64Array, tints?: Float32Array, table?: Float32Array}}
 *     VertexArrays */

/** @param {Uint8Array} bytes @param {Find} find @returns {Parsed} */
export function parsePly(bytes, find) {
    const {elements, encoding, textures, start} = plyHeader(bytes), faces = new FaceReader();
    const isText = encoding === "ascii",
        source = isText ?
            new TextReader(bytes, start)
            : new BinaryNumbers(bytes, start, encoding === "binary_little_endian");
    let shape = /** @type {VertexArrays} */ ({});
    for (const {name, count, properties} of elements) {
        const least = properties.reduce((sum, {type, list}) => sum + (isText ? 2 : SIZES[list ?? type]), 0);
        demand(count * least <= bytes.length + 1, "a count does not fit the file");
        if (name === "vertex") shape = vertexArrays(properties, count);
        const isFace = name === "face" || name === STRIPS;
        if (isFace) faces.begin(properties, name === STRIPS);
        for (let i = 0; i < count; ++i) {
            for (const property of properties) {
                if (property.list) {
                    faces.read(source, property);
                } else {
                    const value = source.next(property.type);
                    if (property.to) property.to[property.width * i + property.place] = property.scale * value;
                }
            }
            if (isFace) faces.finish();
        }
    }
    demand(shape.vertices, "the vertices have no x, y and z");
    return {...shape, tints: shape.tints && unitColors(shape.tints), ...faces.result(shape, textures, find)};
}

/** Gives properties places in arrays, and returns those that the file has.
 * @param {Property[]} properties @param {number} count */
function vertexArrays(properties, count) {
    /** @type {Record<string, Float64Array | Float32Array>} */
    const arrays = {};
    demand(!properties.some(({name}) => name === "packed_position"), "compressed Gaussian splats, not a surface");
    for (const [group, choices] of Object.entries(GROUPS)) {
        const found = chosenProperties(properties, choices);
        if (!found) continue;
        demandFew(count / 3, "points");
        const exact = group === "vertices" || group === "normals";
        arrays[group] = new (exact ? Float64Array : Float32Array)(count * found.length);
        found.forEach((property, place) => {
            const scale = group === "tints" ? colorScale(property.type) : 1;
            Object.assign(property, {to: arrays[group], width: found.length, place, scale});
        });
    }
    return /** @type {VertexArrays} */ (arrays);
}

// The numbers of binary data. Throws RangeError at the end.
class BinaryNumbers {
    /** @param {Uint8Array} bytes @param {number} start @param {boolean} isLittle */
    constructor(bytes, start, isLittle) {
        this.view = viewOf(bytes);
        this.at = start;
        this.isLittle = isLittle;
    }

    /** @param {NumberType} type */
    next(type) {
        const value = numberAt(this.view, type, this.at, this.isLittle);
        this.at += SIZES[type];
        return value;
    }
}
