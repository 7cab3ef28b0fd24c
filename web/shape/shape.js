import {NORMAL, SAMPLE} from "../kernel/kernel.js";
import {randomNumbers} from "../kernel/random.js";
import {demand} from "../read/mesh_parts.js";
import {SurfaceColors} from "../read/surface_colors.js";
import {cutTriangle, flatFacets} from "./curved_surface.js";
import {crossProducts} from "./face_normals.js";
import {Surface} from "./surface.js";
import {Tree} from "./tree.js";
import {Winding} from "./winding.js";
/** @import {ShapeColors} from "../read/mesh_file.js" */
/** @import {Facets} from "./curved_surface.js" */

const PROBES = 2000; // points below the surface, where a mesh must enclose some volume

/** A triangle mesh in model space, to train on, or the facets of its curved surface (trainer/shapes/mesh.py). */
export class Shape extends Surface {
    /** Throws MeshError if the mesh encloses no volume. @param {Float64Array} vertices (3 V)
     * @param {Uint32Array} faces (3 F) @param {ShapeColors | null} colors @param {Facets} facets */
    constructor(vertices, faces, colors = null, facets = flatFacets(vertices, faces)) {
        super();
        this.isExact = true; // its distances
        this.vertices = vertices;
        this.facets = facets;
        this.colors = colors && new SurfaceColors(colors, faces);
        this.pieces = cutTriangle(facets.cuts); // of a face
        this.tree = new Tree(facets.vertices, facets.faces);
        this.winding = new Winding(this.tree);
        const products = crossProducts(facets.vertices, facets.faces);
        this.areas = new Float64Array(products.length / 3); // cumulative
        for (let i = 0, sum = 0; i < products.length; i += 3) {
            this.areas[i / 3] = sum += Math.hypot(products[i], products[i + 1], products[i + 2]);
        }
        this.demandVolume();
    }

    // Throws MeshError if no point just below the surface is inside the mesh.
    demandVolume() {
        const rows = this.surface(PROBES, randomNumbers(0));
        for (let at = 0; at < rows.length; at += SAMPLE) {
            const depth = 1e-4 * 3000 ** (at / rows.length);
            const below = (/** @type {number} */ k) => rows[at + k] - depth * rows[at + NORMAL + k];
            if (this.winding.isInside(below(0), below(1), below(2))) return;
        }
        demand(false, "the mesh encloses no volume; use a closed surface, or: mplicits train --thicken T");
    }

    /** Draws points of the surface, uniformly by area. Returns rows of samples with distance 0 and the surface's
     * normals. colors: gets the points' colors.
     * @param {number} count @param {() => number} random @param {Float32Array | null} colors */
    surface(count, random, colors = null) {
        const {areas} = this, rows = new Float32Array(SAMPLE * count), weights = new Float64Array(3);
        for (let i = 0; i < count; ++i) {
            const facet = placeOf(areas, random() * areas[areas.length - 1]);
            let s = random(), t = random();
            if (s + t > 1) [s, t] = [1 - s, 1 - t];
            weights[0] = 1 - s - t;
            weights[1] = s;
            weights[2] = t;
            this.place(facet, weights, rows, SAMPLE * i);
            if (colors) this.color(facet, weights, colors, 3 * i);
        }
        return rows;
    }

    /** Writes the point at barycentric coordinates of a facet, and its normal, to a row of samples.
     * @param {number} facet @param {Float64Array} weights @param {Float32Array} rows @param {number} at */
    place(facet, weights, rows, at) {
        const {vertices, faces, normals, normalOf} = this.facets;
        let squared = 0;
        for (let k = 0; k < 3; ++k) {
            let c = 0, n = 0;
            for (let j = 0; j < 3; ++j) {
                c += weights[j] * vertices[3 * faces[3 * facet + j] + k];
                n += weights[j] * normals[3 * normalOf[3 * facet + j] + k];
            }
            rows[at + k] = c;
            rows[at + NORMAL + k] = n;
            squared += n * n;
        }
        const length = Math.sqrt(squared) || 1;
        for (let k = 0; k < 3; ++k) rows[at + NORMAL + k] /= length;
    }

    /** Writes the color there to an array.
     * @param {number} facet @param {Float64Array} weights @param {Float32Array} to @param {number} at */
    color(facet, weights, to, at) {
        const {grid, corners} = this.pieces, size = corners.length / 3, face = Math.floor(facet / size);
        let s = 0, t = 0; // in the face
        for (let j = 0; j < 3; ++j) {
            const corner = 3 * corners[3 * (facet % size) + j];
            s += weights[j] * grid[corner + 1];
            t += weights[j] * grid[corner + 2];
        }
        this.colors?.write(face, s, t, to, at);
    }

    /** Returns the signed distance of a place: negative where the winding number exceeds 1/2.
     * @param {number} x @param {number} y @param {number} z */
    distance(x, y, z) {
        this.tree.nearest(x, y, z);
        return Math.sqrt(this.tree.squared) * (this.winding.isInside(x, y, z) ? -1 : 1);
    }
}

/** Returns the first place of a sorted array whose number exceeds a value.
 * @param {Float64Array} sorted @param {number} value */
export function placeOf(sorted, value) {
    let low = 0, high = sorted.length - 1;
    while (low < high) {
        const middle = (low + high) >> 1;
        if (sorted[middle] > value) high = middle;
        else low = middle + 1;
    }
    return low;
}
