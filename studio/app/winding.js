// The generalized winding number of a mesh (Jacobson et al. 2013): 1 inside a closed surface, 0 outside. Far parts of
// the mesh count as their first two moments (Barill et al. 2018).
const FAR = 2.5; // a node is far from a point at this many radii
const CENTER = 0, RADIUS = 3, FLUX = 4, SPREAD = 7, MOMENTS = 16; // floats of a node, by their places

export class Winding {
    // tree: of the mesh (tree.js).
    constructor(tree) {
        this.tree = tree;
        this.moments = new Float64Array(MOMENTS * tree.nodes);
        this.areas = new Float64Array(tree.nodes);
        for (let node = tree.nodes - 1; node >= 0; --node) this.gather(node);
        this.stack = new Int32Array(tree.stack.length);
    }

    // Sets a node's moments: the center of its area, the radius around it, the sum of (area x normal), and the sum of
    // (area x normal) x (middle - center), a matrix.
    gather(node) {
        const {tree, moments, areas} = this, at = MOMENTS * node;
        const parts = tree.size[node] ? this.facesOf(node) : [0, 1].map((i) => this.child(tree.first[node] + i));
        for (const {area, center, normal} of parts) {
            areas[node] += area;
            for (let k = 0; k < 3; ++k) {
                moments[at + CENTER + k] += area * center[k];
                moments[at + FLUX + k] += normal[k];
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
        for (const {center, normal, spread} of parts) {
            for (let k = 0; k < 9; ++k) {
                const moved = normal[Math.floor(k / 3)] * (center[k % 3] - moments[at + CENTER + k % 3]);
                moments[at + SPREAD + k] += moved + (spread ? spread[k] : 0);
            }
        }
    }

    child(node) {
        const at = MOMENTS * node, of = (from, count) => this.moments.subarray(at + from, at + from + count);
        return {area: this.areas[node], center: of(CENTER, 3), normal: of(FLUX, 3), spread: of(SPREAD, 9)};
    }

    facesOf(node) {
        const {vertices, faces, order, first, size} = this.tree;
        return Array.from(order.subarray(first[node], first[node] + size[node]), (face) => {
            const corner = (i) => vertices.subarray(3 * faces[3 * face + i], 3 * faces[3 * face + i] + 3);
            const [a, b, c] = [corner(0), corner(1), corner(2)];
            const normal = [0, 1, 2].map((k) => {
                const l = (k + 1) % 3, m = (k + 2) % 3;
                return ((b[l] - a[l]) * (c[m] - a[m]) - (b[m] - a[m]) * (c[l] - a[l])) / 2;
            });
            return {area: Math.hypot(...normal), center: [0, 1, 2].map((k) => (a[k] + b[k] + c[k]) / 3), normal};
        });
    }

    at(x, y, z) {
        const {tree: {first, size, order}, moments, stack} = this;
        let depth = 1, angle = 0;
        stack[0] = 0;
        while (depth) {
            const node = stack[--depth], at = MOMENTS * node;
            const rx = moments[at] - x, ry = moments[at + 1] - y, rz = moments[at + 2] - z;
            const squared = rx * rx + ry * ry + rz * rz, far = FAR * moments[at + RADIUS];
            if (squared > far * far) {
                angle += this.ofMoments(at, rx, ry, rz, squared);
            } else if (size[node]) {
                const end = first[node] + size[node];
                for (let i = first[node]; i < end; ++i) angle += this.ofTriangle(order[i], x, y, z);
            } else {
                stack[depth++] = first[node];
                stack[depth++] = first[node] + 1;
            }
        }
        return angle / (4 * Math.PI);
    }

    // Returns the solid angle of a far node. r: from the point to the node's center.
    ofMoments(at, rx, ry, rz, squared) {
        const m = this.moments, n = at + FLUX, s = at + SPREAD;
        const trace = m[s] + m[s + 4] + m[s + 8];
        const bent = rx * (m[s] * rx + m[s + 1] * ry + m[s + 2] * rz)
            + ry * (m[s + 3] * rx + m[s + 4] * ry + m[s + 5] * rz)
            + rz * (m[s + 6] * rx + m[s + 7] * ry + m[s + 8] * rz);
        const sum = rx * m[n] + ry * m[n + 1] + rz * m[n + 2] + trace - 3 * bent / squared;
        return sum / (squared * Math.sqrt(squared));
    }

    // Returns the solid angle of a triangle (van Oosterom and Strackee 1983).
    ofTriangle(triangle, x, y, z) {
        const {vertices: v, faces} = this.tree;
        const a = 3 * faces[3 * triangle], b = 3 * faces[3 * triangle + 1], c = 3 * faces[3 * triangle + 2];
        const ax = v[a] - x, ay = v[a + 1] - y, az = v[a + 2] - z;
        const bx = v[b] - x, by = v[b + 1] - y, bz = v[b + 2] - z;
        const cx = v[c] - x, cy = v[c + 1] - y, cz = v[c + 2] - z;
        const la = Math.sqrt(ax * ax + ay * ay + az * az), lb = Math.sqrt(bx * bx + by * by + bz * bz);
        const lc = Math.sqrt(cx * cx + cy * cy + cz * cz);
        const volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
        const ab = ax * bx + ay * by + az * bz, bc = bx * cx + by * cy + bz * cz, ca = cx * ax + cy * ay + cz * az;
        return 2 * Math.atan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb);
    }
}
