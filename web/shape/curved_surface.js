import {ALONG_CREASE, CREASE_SINE_SQUARED, DECIMALS_OF_PLACES, MOST_CUTS, MOST_FACETS} from "../model/constants.js";
import {firstEqual} from "../read/equal_points.js";
import {nextHalf, partnersOf} from "./edges.js";
import {crossProducts, meanNormals, toUnits} from "./face_normals.js";
/** @import {CornerNormals} from "../read/mesh_file.js" */

// The curved surface of a mesh (trainer/shapes/curved.py): each triangle becomes a point-normal triangle (Vlachos et
// al. 2001), a cubic patch through its corners that is perpendicular to their normals, cut into flat facets. Neighbors
// share the curve over their common edge; the curve of a crease runs along both of its sides.
const UNITS = 10 ** DECIMALS_OF_PLACES; // positions and normals that agree in whole units are equal

/** Flat facets (3 N): vertices (3 V); normals of the surface, unit vectors; normalOf: each corner's. Those of face i
 * begin at i cuts^2, in the order of cutTriangle().
 * @typedef {{vertices: Float64Array, faces: Uint32Array, normals: Float32Array, normalOf: CornerNormals["index"],
 *     cuts: number}} Facets */

/** Curves and cuts a mesh; a fine mesh keeps its faces.
 * @param {Float64Array} vertices @param {Uint32Array} faces @param {CornerNormals} normals @returns {Facets} */
export function curvedFacets(vertices, faces, normals) {
    const count = faces.length / 3;
    const cuts = Math.min(MOST_CUTS, Math.max(1, Math.floor(Math.sqrt(MOST_FACETS / count))));
    if (cuts === 1) {
        return {vertices, faces, normals: Float32Array.from(normals.values), normalOf: normals.index, cuts};
    }
    const {grid, corners} = cutTriangle(cuts), size = grid.length / 3, basis = basisOf(grid);
    const points = new Float64Array(3 * size * count), mixed = new Float64Array(points.length);
    const facets = new Uint32Array(corners.length * count), controls = edgeControls(vertices, faces, normals);
    const patch = new Float64Array(30), ends = new Float64Array(9);
    for (let face = 0; face < count; ++face) {
        for (let k = 0; k < 9; ++k) {
            const corner = 3 * face + Math.floor(k / 3);
            patch[k] = vertices[3 * faces[corner] + k % 3];
            ends[k] = normals.values[3 * normals.index[corner] + k % 3];
        }
        patch.set(controls.subarray(18 * face, 18 * face + 18), 9);
        for (let k = 0; k < 3; ++k) { // the middle
            let inner = 0;
            for (let i = 9 + k; i < 27; i += 3) inner += patch[i];
            patch[27 + k] = inner / 4 - (patch[k] + patch[3 + k] + patch[6 + k]) / 6;
        }
        for (let i = 0, to = 3 * size * face; i < size; ++i, to += 3) {
            blend(basis, 10 * i, patch, points, to);
            blend(grid, 3 * i, ends, mixed, to);
        }
        for (let i = 0; i < corners.length; ++i) facets[corners.length * face + i] = size * face + corners[i];
    }
    const own = ownNormals(points, facets, toUnits(mixed));
    return {vertices: points, faces: facets, normals: own, normalOf: facets, cuts};
}

/** Returns the faces of a mesh as facets.
 * @param {Float64Array} vertices @param {Uint32Array} faces @returns {Facets} */
export function flatFacets(vertices, faces) {
    const normals = Float32Array.from(toUnits(crossProducts(vertices, faces)));
    return {vertices, faces, normals, normalOf: faces.map((_, i) => Math.floor(i / 3)), cuts: 1};
}

/** Cuts a triangle. Returns barycentric coordinates of M places (3 M), and the corners of the facets, their places
 * (3 cuts^2). @param {number} cuts */
export function cutTriangle(cuts) {
    const grid = [], corners = [], down = [];
    const place = (/** @type {number} */ i, /** @type {number} */ j) => i * (cuts + 1) - i * (i - 1) / 2 + j;
    for (let i = 0; i <= cuts; ++i) {
        for (let j = 0; j <= cuts - i; ++j) {
            grid.push((cuts - i - j) / cuts, i / cuts, j / cuts);
            if (i + j < cuts) corners.push(place(i, j), place(i + 1, j), place(i, j + 1));
            if (i + j < cuts - 1) down.push(place(i + 1, j), place(i + 1, j + 1), place(i, j + 1));
        }
    }
    return {grid: Float64Array.from(grid), corners: [...corners, ...down]};
}

/** Writes a weighted sum of vectors to an array.
 * @param {Float64Array} weights @param {number} first place of their weights
 * @param {Float64Array} vectors @param {Float64Array} to @param {number} at */
function blend(weights, first, vectors, to, at) {
    let x = 0, y = 0, z = 0;
    for (let k = 0; k < vectors.length; k += 3) {
        const weight = weights[first++];
        x += weight * vectors[k];
        y += weight * vectors[k + 1];
        z += weight * vectors[k + 2];
    }
    to[at] = x;
    to[at + 1] = y;
    to[at + 2] = z;
}

/** Returns the cubic Bernstein polynomials at barycentric coordinates (3 M): of the corners, of two places on each
 * edge, and of the middle (10 M). @param {Float64Array} grid */
function basisOf(grid) {
    const basis = [];
    for (let i = 0; i < grid.length; i += 3) {
        const u = grid[i], v = grid[i + 1], w = grid[i + 2];
        basis.push(u ** 3, v ** 3, w ** 3);
        for (const [a, b] of [[u, v], [v, w], [w, u]]) basis.push(3 * a * a * b, 3 * a * b * b);
        basis.push(6 * u * v * w);
    }
    return Float64Array.from(basis);
}

/** Returns the two inner control points of the curve over each half edge, from its start to its end, six numbers for
 * each. They lie a third along the edge, projected into the tangent plane of the nearer end; at a crease, where both
 * sides have different normals, onto the line in both planes.
 * @param {Float64Array} vertices @param {Uint32Array} faces @param {CornerNormals} normals */
function edgeControls(vertices, faces, {values, index}) {
    const partners = partnersOf(faces, vertices.length / 3), controls = new Float64Array(6 * faces.length);
    const edge = new Float64Array(3), moved = new Float64Array(3);
    for (let half = 0; half < faces.length; ++half) {
        const next = nextHalf(half), partner = partners[half];
        for (let k = 0; k < 2; ++k) {
            const near = k ? next : half, far = k ? half : next;
            const across = partner < 0 ? near : k ? partner : nextHalf(partner);
            const from = 3 * faces[near], to = 3 * faces[far];
            for (let i = 0; i < 3; ++i) edge[i] = vertices[to + i] - vertices[from + i];
            toTangent(edge, values, 3 * index[near], 3 * index[across], moved);
            for (let i = 0; i < 3; ++i) controls[6 * half + 3 * k + i] = vertices[from + i] + moved[i] / 3;
        }
    }
    return controls;
}

/** Projects an edge into the plane of the mean of two normals, or onto the line in the planes of both.
 * @param {Float64Array} edge @param {CornerNormals["values"]} normals @param {number} one @param {number} other
 * @param {Float64Array} to */
function toTangent([x, y, z], normals, one, other, to) {
    const a = normals[one], b = normals[one + 1], c = normals[one + 2];
    const d = normals[other], e = normals[other + 1], f = normals[other + 2];
    const lx = b * f - c * e, ly = c * d - a * f, lz = a * e - b * d, squared = lx * lx + ly * ly + lz * lz; // the line
    const along = x * lx + y * ly + z * lz;
    if (squared > CREASE_SINE_SQUARED && along * along > ALONG_CREASE ** 2 * squared * (x * x + y * y + z * z)) {
        to[0] = along / squared * lx;
        to[1] = along / squared * ly;
        to[2] = along / squared * lz;
        return;
    }
    const mx = a + d, my = b + e, mz = c + f, share = (x * mx + y * my + z * mz) / (mx * mx + my * my + mz * mz || 1);
    to[0] = x - share * mx;
    to[1] = y - share * my;
    to[2] = z - share * mz;
}

/** Averages the facets' normals around each position. Mixed normals are not perpendicular to the patch; they separate
 * the sides of a crease. Returns normals of the vertices (3 V).
 * @param {Float64Array} vertices @param {Uint32Array} facets @param {Float64Array} mixed */
function ownNormals(vertices, facets, mixed) {
    const count = vertices.length / 3, rows = new Float64Array(6 * count), normals = new Float32Array(mixed);
    for (let i = 0; i < count; ++i) {
        for (let k = 0; k < 3; ++k) {
            rows[6 * i + k] = Math.round(UNITS * vertices[3 * i + k]);
            rows[6 * i + 3 + k] = Math.round(UNITS * mixed[3 * i + k]);
        }
    }
    const first = firstEqual(rows, 6), groups = facets.map((vertex) => first[vertex]);
    const means = meanNormals(vertices, facets, crossProducts(vertices, facets), groups, count);
    for (let i = 0; i < count; ++i) {
        const at = 3 * first[i];
        if (means[at] || means[at + 1] || means[at + 2]) normals.set(means.subarray(at, at + 3), 3 * i);
    }
    return normals;
}
