// The table of marching cubes (Lorensen and Cline 1987), by code. Corner i of a cell lies at the bits of i: x, y, z.
// An edge is 3 times its lower corner, plus its axis.
const FACES_OF_CELL = [1, 2, 4].flatMap((w) => { // four corners, counter-clockwise from outside
    const u = w === 4 ? 1 : 2 * w, v = 7 - u - w;
    const axis = w >> 1;
    return [{axis, side: 1, corners: [w, w | u, 7, w | v]}, {axis, side: -1, corners: [0, v, u | v, u]}];
});

// Kind of a cell, whose i-th bit says whether corner i is inside -> {triangles, onward}. triangles: edges that their
// corners lie on, counter-clockwise from outside; onward: faces of the cell that the surface goes through.
export const CELL_KINDS = Array.from({length: 256}, (_, kind) => {
    const next = new Map(), onward = /** @type {typeof FACES_OF_CELL} */ ([]);
    for (const face of FACES_OF_CELL) {
        const corner = (/** @type {number} */ k) => face.corners[k & 3];
        const isInside = (/** @type {number} */ k) => kind >> corner(k) & 1;
        for (let k = 0; k < 4; ++k) {
            if (!isInside(k) || isInside(k + 1)) continue;
            let first = k; // a line of the surface cuts corners `first` to k off
            while (isInside(first - 1)) --first;
            next.set(edgeOf(corner(first - 1), corner(first)), edgeOf(corner(k), corner(k + 1)));
            if (!onward.includes(face)) onward.push(face);
        }
    }
    return {triangles: trianglesOf(next), onward};
});

/** @param {number} one @param {number} other */
function edgeOf(one, other) {
    return 3 * (one & other) + ((one ^ other) >> 1);
}

/** Triangles of the polygons whose corners follow one another by a map. No new line lies in a face of the cell, where
 * the next cell may have the same line: each line belongs to two triangles. @param {Map<number, number>} next */
function trianglesOf(next) {
    const triangles = [];
    while (next.size) {
        const ring = /** @type {number[]} */ ([]);
        for (let edge = next.keys().next().value; edge !== undefined && next.has(edge);) {
            ring.push(edge);
            const after = next.get(edge);
            next.delete(edge);
            edge = after;
        }
        while (ring.length > 2) {
            const at = (/** @type {number} */ k) => ring[k % ring.length];
            const k = ring.findIndex((_, i) => ring.length === 3 || !shareFace(at(i), at(i + 2)));
            triangles.push(at(k), at(k + 1), at(k + 2));
            ring.splice((k + 1) % ring.length, 1);
        }
    }
    return triangles;
}

/** @param {...number} edges */
function shareFace(...edges) {
    const corners = edges.flatMap((edge) => [Math.floor(edge / 3), Math.floor(edge / 3) | 1 << edge % 3]);
    return corners.reduce((a, b) => a & b) > 0 || corners.reduce((a, b) => a | b) < 7;
}
