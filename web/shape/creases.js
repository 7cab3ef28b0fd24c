import {LEAST_COSINE, SHARP, SHARPER} from "../model/constants.js";
import {firstNumbers} from "../read/mesh_parts.js";
import {nextHalf, partnersOf} from "./edges.js";
import {crossProducts, meanNormals, toUnits} from "./face_normals.js";
/** @import {CornerNormals} from "../read/mesh_file.js" */

// Normals at the corners of faces: smooth across edges, except for creases (trainer/shapes/creases.py).
const MOST_BESIDE = 1000; // edges at a vertex that are compared, so that a fan of many faces takes no square of them

/** Averages the normals of faces around each vertex, up to the next crease; uses the file's normals where they fit.
 * Returns unit vectors. @param {Float64Array} vertices @param {Uint32Array} faces
 * @param {number} crease least angle of a crease, degrees @param {CornerNormals | null} own the file's normals */
export function cornerNormals(vertices, faces, crease, own) {
    const partners = partnersOf(faces, vertices.length / 3), products = crossProducts(vertices, faces);
    const normals = toUnits(products.slice());
    const {index, count} = smoothGroups(partners, creaseFinder(vertices, faces, partners, normals, crease));
    const means = meanNormals(vertices, faces, products, index, count), more = [];
    for (let i = 0; i < index.length; ++i) {
        const at = 3 * index[i];
        if (means[at] || means[at + 1] || means[at + 2]) continue; // else the normals cancel
        index[i] = count + more.length / 3;
        more.push(...normals.subarray(i - i % 3, i - i % 3 + 3));
    }
    if (!own) return {values: joined(means, more), index};
    const found = toUnits(Float64Array.from(own.values)), first = (means.length + more.length) / 3;
    for (let i = 0; i < index.length; ++i) {
        const n = 3 * own.index[i], f = i - i % 3;
        const cosine = found[n] * normals[f] + found[n + 1] * normals[f + 1] + found[n + 2] * normals[f + 2];
        if (cosine > LEAST_COSINE) index[i] = first + own.index[i];
    }
    return {values: joined(means, more, found), index};
}

/** Returns a function that says whether a half edge with a partner is on a crease. An edge bends by the angle between
 * its faces' normals. It is a crease if it bends by more than `crease` and SHARPER times as much as the parallel edges
 * at the third corners of both faces. A coarse round part fails this test, since its edges bend alike.
 * @param {Float64Array} v vertices @param {Uint32Array} faces @param {Int32Array} partners
 * @param {Float64Array} normals @param {number} crease */
function creaseFinder(v, faces, partners, normals, crease) {
    const radians = Math.PI / 180, limit = crease * radians, sharp = Math.max(crease, SHARP) * radians;
    const {starts, edges} = edgesAround(faces, partners, v.length / 3);

    /** Returns the cosine of the angle between two edges. @param {number} one @param {number} other */
    function cosine(one, other) {
        let product = 0, mine = 0, theirs = 0;
        for (let k = 0; k < 3; ++k) {
            const c = v[3 * faces[nextHalf(one)] + k] - v[3 * faces[one] + k];
            const d = v[3 * faces[nextHalf(other)] + k] - v[3 * faces[other] + k];
            product += c * d;
            mine += c * c;
            theirs += d * d;
        }
        return product / (Math.sqrt(mine * theirs) || 1);
    }

    /** Returns the angle by which an edge bends; negative in a valley. @param {number} half */
    function bend(half) {
        const one = half - half % 3, other = partners[half] - partners[half] % 3;
        const start = 3 * faces[half], end = 3 * faces[nextHalf(half)];
        const x = v[end] - v[start], y = v[end + 1] - v[start + 1], z = v[end + 2] - v[start + 2];
        const a = normals[one], b = normals[one + 1], c = normals[one + 2];
        const d = normals[other], e = normals[other + 1], f = normals[other + 2];
        const across = (b * f - c * e) * x + (c * d - a * f) * y + (a * e - b * d) * z;
        return Math.atan2(across / (Math.sqrt(x * x + y * y + z * z) || 1), a * d + b * e + c * f);
    }

    /** @param {number} half @param {number} sign */
    function bendBeside(half, sign) {
        const start = faces[half], end = faces[nextHalf(half)];
        let most = 0;
        for (const side of [half, partners[half]]) {
            const vertex = faces[nextHalf(nextHalf(side))], first = starts[vertex];
            for (let i = first; i < starts[vertex + 1] && i < first + MOST_BESIDE; ++i) {
                const other = edges[i], a = faces[other], b = faces[nextHalf(other)];
                if (a === start || a === end || b === start || b === end) continue;
                most = Math.max(most, Math.abs(cosine(half, other)) * sign * bend(other));
            }
        }
        return most;
    }

    return (/** @type {number} */ half) => {
        const angle = bend(half), size = Math.abs(angle);
        return size > sharp || (size > limit && size > SHARPER * bendBeside(half, Math.sign(angle)));
    };
}

/** Returns the half edges with two faces at each vertex, and the first place of each vertex in them.
 * @param {Uint32Array} faces @param {Int32Array} partners @param {number} count of vertices */
function edgesAround(faces, partners, count) {
    const starts = new Uint32Array(count + 2), edges = new Uint32Array(faces.length);
    const visit = (/** @type {(vertex: number, half: number) => void} */ action) => {
        for (let half = 0; half < faces.length; ++half) {
            if (partners[half] > half) { for (const end of [half, nextHalf(half)]) action(faces[end], half); }
        }
    };
    visit((vertex) => {
        ++starts[vertex + 2];
    });
    for (let i = 2; i < starts.length; ++i) starts[i] += starts[i - 1];
    visit((vertex, half) => {
        edges[starts[vertex + 1]++] = half;
    });
    return {starts, edges};
}

/** Groups the corners around each vertex, up to the next crease. Returns the group of each corner (3 F).
 * @param {Int32Array} partners @param {(half: number) => boolean} isCrease */
function smoothGroups(partners, isCrease) {
    const index = firstNumbers(Uint32Array, partners.length); // of an earlier corner of the group, or of itself
    const firstOf = (/** @type {number} */ i) => {
        while (index[i] !== i) i = index[i] = index[index[i]];
        return i;
    };
    const join = (/** @type {number} */ i, /** @type {number} */ j) => {
        const one = firstOf(i), other = firstOf(j);
        index[Math.max(one, other)] = Math.min(one, other);
    };
    for (let half = 0; half < partners.length; ++half) {
        const partner = partners[half];
        if (partner < half || isCrease(half)) continue;
        join(half, nextHalf(partner));
        join(nextHalf(half), partner);
    }
    let count = 0;
    for (let i = 0; i < index.length; ++i) index[i] = index[i] === i ? count++ : index[index[i]];
    return {index, count};
}

/** @param {...ArrayLike<number>} parts */
function joined(...parts) {
    const whole = new Float64Array(parts.reduce((sum, {length}) => sum + length, 0));
    let at = 0;
    for (const part of parts) {
        whole.set(part, at);
        at += part.length;
    }
    return whole;
}
