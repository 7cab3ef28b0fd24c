import {firstNumbers} from "../read/mesh_parts.js";

// The edges of triangles. Half edge 3 f + k runs from corner k of face f to the face's next corner.

/** @param {number} half */
export const nextHalf = (half) => (half % 3 < 2 ? half + 1 : half - 2);

/** Sorts half edges so that those of one edge follow one another. isSame: whether the i-th of them has the edge of the
 * one before. @param {Uint32Array} faces (3 F) @param {number} count of vertices */
export function sortedEdges(faces, count) {
    const edges = faces.length, low = new Uint32Array(edges), high = new Uint32Array(edges);
    for (let i = 0; i < edges; ++i) {
        const a = faces[i], b = faces[nextHalf(i)];
        low[i] = a < b ? a : b;
        high[i] = a < b ? b : a;
    }
    const order = sortedBy(low, sortedBy(high, firstNumbers(Uint32Array, edges), count), count);
    return {
        order,
        isSame: (/** @type {number} */ i) =>
            low[order[i]] === low[order[i - 1]] && high[order[i]] === high[order[i - 1]],
    };
}

/** Returns for each half edge the opposite one, if exactly two faces share the edge and agree on their sides; else -1.
 * @param {Uint32Array} faces @param {number} count */
export function partnersOf(faces, count) {
    const {order, isSame} = sortedEdges(faces, count), partners = new Int32Array(faces.length).fill(-1);
    for (let from = 0, to = 0; from < order.length; from = to) {
        for (to = from + 1; to < order.length && isSame(to);) ++to;
        const one = order[from], other = order[from + 1];
        if (to - from !== 2 || faces[one] === faces[other]) continue;
        partners[one] = other;
        partners[other] = one;
    }
    return partners;
}

/** Returns an order of keys, sorted by keys below `count`; equal ones stay in their order.
 * @param {Uint32Array} keys @param {Uint32Array} order @param {number} count */
function sortedBy(keys, order, count) {
    const starts = new Uint32Array(count + 1), sorted = new Uint32Array(order.length);
    for (let i = 0; i < keys.length; ++i) ++starts[keys[i] + 1];
    for (let i = 0; i < count; ++i) starts[i + 1] += starts[i];
    for (let i = 0; i < order.length; ++i) sorted[starts[keys[order[i]]]++] = order[i];
    return sorted;
}
