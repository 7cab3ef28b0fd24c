/** @import {Tree} from "./tree.js" */

const FAR = 2.5; // a node is far from a point at this many radii
const ROUGHLY_FAR = 1.3, DOUBT = 0.25; // it is at these, unless the result differs from 1/2 by less
const FULL = 4 * Math.PI; // solid angle
const CENTER = 0, RADIUS = 3, FLUX = 4, SPREAD = 7, MOMENTS = 16; // floats of a node, by their places

/** The generalized winding number of a mesh (Jacobson et al. 2013): 1 inside a closed surface, 0 outside. Far parts of
 * the mesh count as their first two moments (Barill et al. 2018). @template {Tree} [T=Tree] */
export class Winding {
    /** @param {T} tree of the mesh */
    constructor(tree) {
        this.tree = tree;
        this.moments = new Float32Array(MOMENTS * tree.nodes);
        this.areas = new Float64Array(tree.nodes);
        this.part = new Float64Array(7);
        for (let node = tree.nodes - 1; node >= 0; --node) this.gather(node);
        this.stack = new Int32Array(tree.stack.length);
    }

    /** Sets a node's moments: the center of its area, the radius around it, the sum of (area x normal), and the sum of
     * (area x normal) x (middle - center), a matrix. @param {number} node */
    gather(node) {
        const {tree, moments, areas, part} = this, at = MOMENTS * node, child = tree.first[node];
        const isLeaf = tree.size[node] > 0, count = isLeaf ? tree.size[node] : 2;
        for (let i = child; i < child + count; ++i) {
            if (isLeaf) this.measure(tree.order[i]);
            else this.measureChild(i);
            areas[node] += part[0];
            for (let k = 0; k < 3; ++k) {
                moments[at + CENTER + k] += part[0] * part[1 + k];
                moments[at + FLUX + k] += part[4 + k];
            }
        }
        let squared = 0;
        for (let k = 0; k < 3; ++k) {
            const low = tree.box[6 * node + k], high = tree.box[6 * node + 3 + k];
            const center = areas[node] > 0 ? moments[at + CENTER + k] / areas[node] : (low + high) / 2;
            moments[at + CENTER + k] = center;
            squared += Math.max(center - low, high - center) ** 2;
        }
        moments[at + RADIUS] = Math.sqrt(squared);
        for (let i = child; i < child + count; ++i) {
            if (isLeaf) this.measure(tree.order[i]);
            else this.measureChild(i);
            for (let k = 0; k < 9; ++k) {
                const moved = part[4 + Math.floor(k / 3)] * (part[1 + k % 3] - moments[at + CENTER + k % 3]);
                moments[at + SPREAD + k] += moved + (isLeaf ? 0 : moments[MOMENTS * i + SPREAD + k]);
            }
        }
    }

    /** Sets `part` to area, center, and area x normal of a node. @param {number} node */
    measureChild(node) {
        this.part[0] = this.areas[node];
        for (let k = 0; k < 3; ++k) {
            this.part[1 + k] = this.moments[MOMENTS * node + CENTER + k];
            this.part[4 + k] = this.moments[MOMENTS * node + FLUX + k];
        }
    }

    /** The same of a triangle. @param {number} face */
    measure(face) {
        const {part, tree: {vertices: v, faces}} = this;
        const a = 3 * faces[3 * face], b = 3 * faces[3 * face + 1], c = 3 * faces[3 * face + 2];
        for (let k = 0; k < 3; ++k) {
            const l = (k + 1) % 3, m = (k + 2) % 3;
            part[1 + k] = (v[a + k] + v[b + k] + v[c + k]) / 3;
            const ul = v[b + l] - v[a + l], um = v[b + m] - v[a + m];
            part[4 + k] = (ul * (v[c + m] - v[a + m]) - um * (v[c + l] - v[a + l])) / 2;
        }
        part[0] = Math.sqrt(part[4] * part[4] + part[5] * part[5] + part[6] * part[6]);
    }

    /** Returns whether a place is inside: where its winding number exceeds 1/2.
     * @param {number} x @param {number} y @param {number} z */
    isInside(x, y, z) {
        const rough = this.at(x, y, z, ROUGHLY_FAR);
        return (Math.abs(rough - 0.5) < DOUBT ? this.at(x, y, z) : rough) > 0.5;
    }

    /** Returns the winding number of a place. distance: at which a node is far, in radii.
     * @param {number} x @param {number} y @param {number} z */
    at(x, y, z, distance = FAR) {
        const {tree: {first, size}, moments, stack} = this;
        let depth = 1, angle = 0;
        stack[0] = 0;
        while (depth) {
            const node = stack[--depth], at = MOMENTS * node;
            const rx = moments[at] - x, ry = moments[at + 1] - y, rz = moments[at + 2] - z;
            const squared = rx * rx + ry * ry + rz * rz, far = distance * moments[at + RADIUS];
            if (squared > far * far) {
                angle += this.ofMoments(at, rx, ry, rz, squared);
            } else if (size[node]) {
                angle += this.ofLeaf(first[node], first[node] + size[node], x, y, z);
            } else {
                stack[depth++] = first[node];
                stack[depth++] = first[node] + 1;
            }
        }
        return angle / FULL;
    }

    /** Returns the solid angle of a far node. r: from the point to the node's center.
     * @param {number} at @param {number} rx @param {number} ry @param {number} rz @param {number} squared */
    ofMoments(at, rx, ry, rz, squared) {
        const m = this.moments, n = at + FLUX, s = at + SPREAD;
        const trace = m[s] + m[s + 4] + m[s + 8];
        const bent = rx * (m[s] * rx + m[s + 1] * ry + m[s + 2] * rz)
            + ry * (m[s + 3] * rx + m[s + 4] * ry + m[s + 5] * rz)
            + rz * (m[s + 6] * rx + m[s + 7] * ry + m[s + 8] * rz);
        const sum = rx * m[n] + ry * m[n + 1] + rz * m[n + 2] + trace - 3 * bent / squared;
        return sum / (squared * Math.sqrt(squared));
    }

    /** Returns the solid angle of triangles at places of `order` (van Oosterom and Strackee 1983). It adds up the
     * angles of a few triangles as the angle of a product of complex numbers, since arc tangents are slow.
     * @param {number} from @param {number} to @param {number} x @param {number} y @param {number} z */
    ofLeaf(from, to, x, y, z) {
        const {vertices: v, faces, order} = this.tree;
        let real = 1, imaginary = 0, angle = 0;
        for (let i = from; i < to; ++i) {
            const at = 3 * order[i], a = 3 * faces[at], b = 3 * faces[at + 1], c = 3 * faces[at + 2];
            const ax = v[a] - x, ay = v[a + 1] - y, az = v[a + 2] - z;
            const bx = v[b] - x, by = v[b + 1] - y, bz = v[b + 2] - z;
            const cx = v[c] - x, cy = v[c + 1] - y, cz = v[c + 2] - z;
            const la = Math.sqrt(ax * ax + ay * ay + az * az), lb = Math.sqrt(bx * bx + by * by + bz * bz);
            const lc = Math.sqrt(cx * cx + cy * cy + cz * cz);
            const volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
            const ab = ax * bx + ay * by + az * bz, bc = bx * cx + by * cy + bz * cz, ca = cx * ax + cy * ay + cz * az;
            const along = la * lb * lc + ab * lc + bc * la + ca * lb, across = real * volume + imaginary * along;
            if (imaginary < 0 === volume < 0 && across < 0 !== volume < 0) angle += volume < 0 ? -FULL : FULL;
            real = real * along - imaginary * volume;
            imaginary = across;
            if (i === to - 1 || (i - from) % 4 === 3) { // before the product gets too small
                angle += 2 * Math.atan2(imaginary, real);
                real = 1;
                imaginary = 0;
            }
        }
        return angle;
    }
}
