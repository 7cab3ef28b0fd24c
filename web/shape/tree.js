import {firstNumbers} from "../read/mesh_parts.js";

const LEAF = 4, BINS = 16, DEEPEST = 64;
const ROUNDING = 1e-7; // model units by which boxes are larger: they are rounded to 32 bits
/** @typedef {Record<"boxes" | "bins" | "costs" | "middles" | "box", Float64Array>} Boxes
 * @typedef {Boxes & {binOf: Uint8Array, counts: Int32Array}} Scratch */

/** A tree of boxes over triangles: the nearest point of a mesh, and its winding number. */
export class Tree {
    /** @param {Float64Array} vertices (3 V), in model space @param {Uint32Array} faces (3 F) */
    constructor(vertices, faces) {
        const count = faces.length / 3, most = Math.max(1, 2 * count);
        this.vertices = vertices;
        this.faces = faces;
        this.order = firstNumbers(Uint32Array, count);
        this.nodes = 1;
        this.last =
            this.squared =
            this.s =
            this.t =
                0;
        this.box = new Float32Array(6 * most); // lower corner, upper corner
        this.first = new Int32Array(most); // of a leaf: its first place in `order`; else: the first of two children
        this.size = new Int32Array(most); // triangles of a leaf; else 0
        this.build();
        this.stack = new Int32Array(2 * DEEPEST);
        this.reach = new Float64Array(2 * DEEPEST);
    }

    build() {
        const scratch = {
            boxes: this.triangleBoxes(),
            binOf: new Uint8Array(this.order.length),
            bins: new Float64Array(6 * BINS),
            counts: new Int32Array(BINS),
            costs: new Float64Array(BINS - 1),
            middles: new Float64Array(6),
            box: new Float64Array(6),
        };
        const pending = [[0, 0, this.order.length, 0]];
        while (pending.length) {
            const [node, from, to, depth] = /** @type {number[]} */ (pending.pop());
            this.enclose(node, from, to, scratch);
            const cut = to - from > LEAF && depth < DEEPEST - 1 ? this.split(from, to, scratch) : from;
            if (cut === from) {
                this.first[node] = from;
                this.size[node] = to - from;
                continue;
            }
            this.first[node] = this.nodes;
            this.nodes += 2;
            pending.push([this.first[node], from, cut, depth + 1], [this.first[node] + 1, cut, to, depth + 1]);
        }
    }

    triangleBoxes() {
        const {vertices, faces} = this, boxes = new Float64Array(2 * faces.length);
        for (let i = 0; i < faces.length / 3; ++i) {
            for (let k = 0; k < 3; ++k) {
                const a = vertices[3 * faces[3 * i] + k], b = vertices[3 * faces[3 * i + 1] + k];
                const c = vertices[3 * faces[3 * i + 2] + k];
                boxes[6 * i + k] = Math.min(a, b, c);
                boxes[6 * i + 3 + k] = Math.max(a, b, c);
            }
        }
        return boxes;
    }

    /** Sets a node's box, and `middles`: the box of twice the middles of its triangles' boxes.
     * @param {number} node @param {number} from @param {number} to @param {Scratch} scratch */
    enclose(node, from, to, {boxes, middles, box}) {
        const {order} = this;
        empty(middles);
        empty(box);
        for (let i = from; i < to; ++i) {
            const of = 6 * order[i];
            grow(box, 0, boxes, of);
            for (let k = 0; k < 3; ++k) {
                const middle = boxes[of + k] + boxes[of + 3 + k];
                if (middle < middles[k]) middles[k] = middle;
                if (middle > middles[3 + k]) middles[3 + k] = middle;
            }
        }
        for (let k = 0; k < 6; ++k) this.box[6 * node + k] = box[k] + (k < 3 ? -ROUNDING : ROUNDING);
    }

    /** Partitions triangles along the longest side by the surface area heuristic with bins (Wald 2007). Returns the
     * place of the cut; `from` where all middles are one point.
     * @param {number} from @param {number} to @param {Scratch} scratch */
    split(from, to, scratch) {
        const {order} = this,
            {boxes, binOf, middles} = scratch,
            side = (/** @type {number} */ k) => middles[3 + k] - middles[k];
        const axis = side(0) >= side(1) && side(0) >= side(2) ? 0 : side(1) >= side(2) ? 1 : 2, low = middles[axis];
        if (!(side(axis) > 0)) return from;
        const scale = BINS * (1 - 1e-12) / side(axis);
        for (let i = from; i < to; ++i) {
            const at = 6 * order[i] + axis;
            binOf[i] = (boxes[at] + boxes[at + 3] - low) * scale;
        }
        const best = this.bestBin(from, to, scratch);
        let left = from, right = to - 1;
        while (left <= right) {
            if (binOf[left] <= best) {
                ++left;
            } else {
                const other = order[right];
                order[right] = order[left];
                order[left] = other;
                binOf[left] = binOf[right--];
            }
        }
        return left;
    }

    /** Returns the last bin of the first part with the smallest sum of (area of the box) x (number of triangles).
     * @param {number} from @param {number} to @param {Scratch} scratch */
    bestBin(from, to, {boxes, binOf, bins, counts, costs, box}) {
        const {order} = this;
        empty(bins);
        counts.fill(0);
        for (let i = from; i < to; ++i) {
            ++counts[binOf[i]];
            grow(bins, 6 * binOf[i], boxes, 6 * order[i]);
        }
        costs.fill(0);
        for (const step of [1, -1]) { // the cost of bins 0 to b, plus the cost of the others
            empty(box);
            for (let i = 0, count = 0, b = step > 0 ? 0 : BINS - 1; i < BINS - 1; ++i, b += step) {
                count += counts[b];
                grow(box, 0, bins, 6 * b);
                const x = box[3] - box[0], y = box[4] - box[1], z = box[5] - box[2];
                costs[step > 0 ? b : b - 1] += count ? count * (x * y + y * z + z * x) : 0;
            }
        }
        let best = 0;
        for (let b = 1; b < costs.length; ++b) if (costs[b] < costs[best]) best = b;
        return best;
    }

    /** Returns the squared distance of a node's box from a point.
     * @param {number} node @param {number} x @param {number} y @param {number} z */
    boxDistance(node, x, y, z) {
        const {box} = this, at = 6 * node;
        const dx = Math.max(box[at] - x, 0, x - box[at + 3]), dy = Math.max(box[at + 1] - y, 0, y - box[at + 4]);
        const dz = Math.max(box[at + 2] - z, 0, z - box[at + 5]);
        return dx * dx + dy * dy + dz * dz;
    }

    /** Returns the triangle nearest to a point, and sets `squared` to the squared distance, and s and t to the place of
     * the nearest point in the triangle. It is fast if the point of the last call was near.
     * @param {number} x @param {number} y @param {number} z */
    nearest(x, y, z) {
        this.squared = this.toTriangle(this.last, x, y, z, Infinity);
        this.descend(x, y, z, this.squared, this);
        return this.last;
    }

    /** Tells a visitor the triangles of boxes within `most`, a squared distance from a point, the nearest boxes first.
     * visit: returns the new `most`. @param {number} x @param {number} y @param {number} z @param {number} most
     * @param {{visit(triangle: number, x: number, y: number, z: number, most: number): number}} visitor */
    descend(x, y, z, most, visitor) {
        const {stack, reach, first, size, order} = this;
        let depth = 1;
        stack[0] = 0;
        reach[0] = this.boxDistance(0, x, y, z);
        while (depth) {
            const node = stack[--depth], child = first[node];
            if (reach[depth] >= most) continue;
            if (size[node]) {
                for (let i = child; i < child + size[node]; ++i) most = visitor.visit(order[i], x, y, z, most);
                continue;
            }
            const one = this.boxDistance(child, x, y, z), two = this.boxDistance(child + 1, x, y, z);
            const far = one < two ? 1 : 0; // the nearer child is on top of the stack
            stack[depth] = child + far;
            reach[depth++] = Math.max(one, two);
            stack[depth] = child + 1 - far;
            reach[depth++] = Math.min(one, two);
        }
    }

    /** @param {number} triangle @param {number} x @param {number} y @param {number} z @param {number} most */
    visit(triangle, x, y, z, most) {
        const squared = this.toTriangle(triangle, x, y, z, most);
        if (!(squared < most)) return most;
        this.last = triangle;
        return this.squared = squared;
    }

    /** Returns the squared distance of a point from a triangle; where it is less than `most`, s and t are set: the
     * nearest point is a + s (b - a) + t (c - a).
     * @param {number} triangle @param {number} x @param {number} y @param {number} z @param {number} most */
    toTriangle(triangle, x, y, z, most) {
        const {vertices, faces} = this;
        const a = 3 * faces[3 * triangle], b = 3 * faces[3 * triangle + 1], c = 3 * faces[3 * triangle + 2];
        const ax = vertices[a], ay = vertices[a + 1], az = vertices[a + 2];
        const ux = vertices[b] - ax, uy = vertices[b + 1] - ay, uz = vertices[b + 2] - az;
        const vx = vertices[c] - ax, vy = vertices[c + 1] - ay, vz = vertices[c + 2] - az;
        const px = x - ax, py = y - ay, pz = z - az;
        const uu = ux * ux + uy * uy + uz * uz, uv = ux * vx + uy * vy + uz * vz, vv = vx * vx + vy * vy + vz * vz;
        const pu = px * ux + py * uy + pz * uz, pv = px * vx + py * vy + pz * vz;
        const area = uu * vv - uv * uv;
        let s = (vv * pu - uv * pv) / area, t = (uu * pv - uv * pu) / area;
        if (!(area > 0 && s >= 0 && t >= 0 && s + t <= 1)) { // the nearest point is on an edge
            const onU = ratio(pu, uu), onV = ratio(pv, vv), between = ratio(pv - pu - uv + uu, uu - 2 * uv + vv);
            const one = squaredLength(px - onU * ux, py - onU * uy, pz - onU * uz);
            const two = squaredLength(px - onV * vx, py - onV * vy, pz - onV * vz);
            const wx = ux + between * (vx - ux), wy = uy + between * (vy - uy), wz = uz + between * (vz - uz);
            const three = squaredLength(px - wx, py - wy, pz - wz);
            s = one <= two && one <= three ? onU : two <= three ? 0 : 1 - between;
            t = one <= two && one <= three ? 0 : two <= three ? onV : between;
        }
        const squared = squaredLength(px - s * ux - t * vx, py - s * uy - t * vy, pz - s * uz - t * vz);
        if (squared < most) {
            this.s = s;
            this.t = t;
        }
        return squared;
    }
}

/** Makes boxes empty. @param {Float64Array} boxes */
function empty(boxes) {
    for (let i = 0; i < boxes.length; ++i) boxes[i] = i % 6 < 3 ? Infinity : -Infinity;
}

/** Enlarges a box by another one.
 * @param {Float64Array} to @param {number} at @param {Float64Array} from @param {number} of */
function grow(to, at, from, of) {
    for (let k = 0; k < 3; ++k) {
        if (from[of + k] < to[at + k]) to[at + k] = from[of + k];
        if (from[of + 3 + k] > to[at + 3 + k]) to[at + 3 + k] = from[of + 3 + k];
    }
}

/** @param {number} x @param {number} y @param {number} z */
function squaredLength(x, y, z) {
    return x * x + y * y + z * z;
}

/** @param {number} part @param {number} whole */
function ratio(part, whole) { // within [0, 1]
    return whole > 0 ? Math.min(1, Math.max(0, part / whole)) : 0;
}
