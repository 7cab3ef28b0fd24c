import {NORMAL, SAMPLE} from "../kernel/kernel.js";
import {NEIGHBORS, OPEN, SIDEWAYS_OF_FOOT, SPREAD_OF_PLANES, TRUSTED, WIDTH} from "../model/constants.js";
import {Neighbors} from "./neighbors.js";
import {Surface} from "./surface.js";
import {Winding} from "./winding.js";
/** @import {ShapeColors} from "../read/mesh_file.js" */
/** @import {Tree} from "./tree.js" */

/** A point cloud with normals in model space, to train on (trainer/shapes/cloud.py, planes.py): its distance comes from
 * the planes through the nearest points where these agree, and farther away from the nearest point. */
export class CloudShape extends Surface {
    /** @param {Float64Array} points (3 N), N at least 100, at different places
     * @param {Float64Array} normals unit vectors (3 N) @param {ShapeColors | null} colors */
    constructor(points, normals, colors = null) {
        super();
        this.vertices = points;
        this.normals = normals;
        this.colors = colors && colors.vertex;
        this.near = new Neighbors(points, NEIGHBORS + 1);
        const areas = this.areas();
        this.spacings = areas.map(Math.sqrt);
        this.winding = new CloudWinding(Object.assign(this.near.tree, {areas, normals}));
        this.weights = new Float64Array(NEIGHBORS);
        this.heights = new Float64Array(NEIGHBORS);
    }

    // Estimates the surface area of each point: the disc to the k-th neighbor contains k + 1/2 points.
    areas() {
        const {near, vertices: points} = this, discs = NEIGHBORS * (NEIGHBORS + 2) / 2;
        return Float64Array.from({length: points.length / 3}, (_, i) => {
            near.find(points[3 * i], points[3 * i + 1], points[3 * i + 2], NEIGHBORS + 1);
            return Math.PI * near.squared.reduce((sum, squared) => sum + squared) / discs;
        });
    }

    /** Draws points, each equally often. Returns rows of samples with distance 0 and the points' normals. colors: gets
     * the points' colors. @param {number} count @param {() => number} random @param {Float32Array | null} colors */
    surface(count, random, colors = null) {
        const {vertices: points, normals} = this, rows = new Float32Array(SAMPLE * count);
        const order = Uint32Array.from({length: points.length / 3}, (_, i) => i);
        for (let i = 0; i < count; ++i) {
            const place = i % order.length, other = place + Math.floor(random() * (order.length - place));
            const point = order[other];
            order[other] = order[place];
            order[place] = point;
            for (let k = 0; k < 3; ++k) {
                rows[SAMPLE * i + k] = points[3 * point + k];
                rows[SAMPLE * i + NORMAL + k] = normals[3 * point + k];
                if (colors && this.colors) colors[3 * i + k] = this.colors[3 * point + k];
            }
        }
        return rows;
    }

    /** Returns the signed distance of a place: NaN where the cloud does not define it.
     * @param {number} x @param {number} y @param {number} z */
    distance(x, y, z) {
        const {near, spacings} = this;
        near.find(x, y, z, NEIGHBORS);
        const nearest = Math.sqrt(near.squared[0]), spacing = spacings[near.index[0]];
        const f = this.toPlanes(x, y, z, spacing);
        if (!Number.isNaN(f) || nearest < TRUSTED * spacing) return f;
        const winding = this.winding.at(x, y, z);
        return Math.abs(winding - 0.5) < OPEN ? NaN : winding > 0.5 ? -nearest : nearest;
    }

    /** Returns the mean distance to the planes of the nearest points, which `near` has found; NaN where they disagree.
     * The normal of each is the mean of its point's and the blended normal, so that the bulge of a sphere cancels.
     * @param {number} x @param {number} y @param {number} z @param {number} spacing */
    toPlanes(x, y, z, spacing) {
        const {vertices: points, normals, weights, heights, near: {index, squared}} = this, n = 3 * index[0];
        const width = (WIDTH * spacing) ** 2;
        let sum = 0, bx = 0, by = 0, bz = 0;
        for (let k = 0; k < NEIGHBORS; ++k) {
            const at = 3 * index[k], nx = normals[at], ny = normals[at + 1], nz = normals[at + 2];
            const isAlike = nx * normals[n] + ny * normals[n + 1] + nz * normals[n + 2] > 0;
            const weight = isAlike ? Math.exp((squared[0] - squared[k]) / width) : 0;
            weights[k] = weight;
            sum += weight;
            bx += weight * nx;
            by += weight * ny;
            bz += weight * nz;
        }
        const length = Math.hypot(bx, by, bz);
        let f = 0, spread = 0;
        for (let k = 0; k < NEIGHBORS; ++k) {
            const at = 3 * index[k], dx = x - points[at], dy = y - points[at + 1], dz = z - points[at + 2];
            const own = dx * normals[at] + dy * normals[at + 1] + dz * normals[at + 2];
            heights[k] = (own + (dx * bx + dy * by + dz * bz) / length) / 2;
            f += weights[k] / sum * heights[k];
        }
        for (let k = 0; k < NEIGHBORS; ++k) spread += weights[k] / sum * (heights[k] - f) ** 2;
        const isSideways = Math.abs(squared[0] - f * f) >= (SIDEWAYS_OF_FOOT * spacing) ** 2;
        return Math.sqrt(spread) < SPREAD_OF_PLANES * spacing && !isSideways ? f : NaN;
    }
}

/** The winding number of a cloud (Barill et al. 2018): its points are small discs.
 * @extends {Winding<Tree & {areas: Float64Array, normals: Float64Array}>} */
class CloudWinding extends Winding {
    /** @override @param {number} point */
    measure(point) {
        const {part, tree: {vertices, areas, normals}} = this;
        part[0] = areas[point];
        for (let k = 0; k < 3; ++k) {
            part[1 + k] = vertices[3 * point + k];
            part[4 + k] = areas[point] * normals[3 * point + k];
        }
    }

    /** Returns the solid angle of discs of points. @override
     * @param {number} from @param {number} to @param {number} x @param {number} y @param {number} z */
    ofLeaf(from, to, x, y, z) {
        const {vertices: v, order, areas, normals: n} = this.tree;
        let angle = 0;
        for (let i = from; i < to; ++i) {
            const at = 3 * order[i], rx = v[at] - x, ry = v[at + 1] - y, rz = v[at + 2] - z;
            const squared = rx * rx + ry * ry + rz * rz, flux = rx * n[at] + ry * n[at + 1] + rz * n[at + 2];
            angle += areas[order[i]] * flux / (squared * Math.sqrt(squared));
        }
        return angle;
    }
}
