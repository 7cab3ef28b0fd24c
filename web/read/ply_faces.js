import {cornerCoordinates, Growing, unitColors} from "./mesh_parts.js";
import {chosenProperties, colorScale, GROUPS} from "./ply_header.js";
import {Polygons} from "./polygons.js";
/** @import {NumberType} from "./binary.js" */
/** @import {Find, FoundMaterial} from "./mesh_file.js" */
/** @import {VertexArrays} from "./ply.js" */
/** @import {List, Property} from "./ply_header.js" */

// The faces or strips of a PLY file, with their texture coordinates and colors.
const CORNERS = ["vertex_indices", "vertex_index"];
export const STRIPS = "tristrips"; // an element

export class FaceReader {
    constructor() {
        this.polygons = new Polygons();
        this.corners = new Growing(Uint32Array);
        this.wedges = new Growing(Float32Array);
        this.table = new Growing(Float32Array);
        this.texture = new Float64Array(1);
        this.color = new Float64Array(3);
        this.colors = new Map();
    }

    /** @param {Property[]} properties @param {boolean} isStrip */
    begin(properties, isStrip) {
        const colors = chosenProperties(properties, GROUPS.tints);
        const [number] = chosenProperties(properties, ["texnumber"]) ?? [];
        colors?.forEach((property, place) => {
            Object.assign(property, {to: this.color, width: 0, place, scale: colorScale(property.type)});
        });
        if (number) Object.assign(number, {to: this.texture, width: 0, place: 0, scale: 1});
        this.isColored = Boolean(colors);
        this.isStrip = isStrip;
    }

    /** Reads a list of a row. @param {{next: (type: NumberType) => number}} source @param {List} property */
    read(source, {name, type, list}) {
        const count = source.next(list), isCorners = CORNERS.includes(name);
        const to = isCorners ? this.corners : name === "texcoord" ? this.wedges : null;
        if (to) to.size = 0;
        for (let k = 0; k < count; ++k) {
            const value = source.next(type);
            if (to) to.push(isCorners && !(value >= 0) ? 2 ** 32 - 1 : value);
        }
    }

    // Ends a row.
    finish() {
        const {corners, wedges, table, polygons} = this;
        if (this.isStrip) {
            addStrip(corners, polygons);
        } else {
            const hasWedges = wedges.size >= 2 * corners.size;
            for (let k = 0; k < corners.size; ++k) {
                polygons.add(corners.array[k], hasWedges ? table.size / 2 : -1);
                for (let i = 0; hasWedges && i < 2; ++i) table.push(wedges.array[2 * k + i]);
            }
            polygons.finish(this.isColored ? this.colorIndex() : this.texture[0]);
        }
        corners.size = wedges.size = 0;
    }

    // Returns the material of a color: colors that agree to 5 or 6 bits are one, so that indices need 16 bits.
    colorIndex() {
        const [r, g, b] = unitColors(this.color);
        const key = Math.round(31 * r) + 32 * Math.round(63 * g) + 2048 * Math.round(31 * b);
        if (!this.colors.has(key)) this.colors.set(key, {index: this.colors.size, color: [r, g, b]});
        return this.colors.get(key).index;
    }

    /** Returns what the faces have of a Parsed shape (mesh_file.js).
     * @param {{vertices?: Float64Array, table?: Float32Array}} arrays table: texture coordinates of the vertices
     * @param {string[]} textures names of images @param {Find} find */
    /** Returns what the faces have of a Parsed shape (mesh_file.js).
     * @param {VertexArrays} arrays @param {string[]} textures names of images @param {Find} find */
    result({vertices, table}, textures, find) {
        const {polygons} = this, wedges = this.table.filled;
        polygons.cutEars(vertices);
        const faces = polygons.vertices.filled, places = polygons.places.filled;
        const uv = wedges.length ? cornerCoordinates(wedges, places) : table ? cornerCoordinates(table, faces) : null;
        const colored = Array.from(this.colors.values(), ({color}) => ({color, image: null}));
        const textured = () => textures.map((name) => ({color: null, image: {name, bytes: find(name)}}));
        return {faces, uv, material: polygons.materials.filled, materials: colored.length ? colored : textured()};
    }
}

/** Adds the triangles of strips, which -1 parts. Every other triangle is turned; strips repeat a vertex to turn.
 * @param {Growing<Uint32Array>} corners @param {Polygons} polygons */
function addStrip({array, size}, polygons) {
    for (let i = 0, start = 0; i < size; ++i) {
        if (array[i] === 2 ** 32 - 1) {
            start = i + 1;
        } else if (i - start > 1 && new Set(array.subarray(i - 2, i + 1)).size === 3) {
            const isTurned = (i - start) % 2;
            for (const k of [i - 2, isTurned ? i : i - 1, isTurned ? i - 1 : i]) polygons.add(array[k]);
            polygons.finish();
        }
    }
}
