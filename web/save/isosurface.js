import {GRADIENT, SAMPLE, VALUE} from "../kernel/kernel.js";
import {TrainingError} from "../kernel/training_error.js";
import {EXTENT, SNAP} from "../model/constants.js";
import {CELL_KINDS} from "./marching.js";

// The zero level set of a function as a closed triangle mesh, by marching cubes on the cells that the surface crosses.
// Blocks of cells that are too far away are skipped; in the others, the surface is followed from cell to cell.
const BLOCKS = 16, SEED = 4; // blocks along the grid at first; cells along the smallest blocks
const STEEPEST = 1.5; // a larger slope may hide a part of the surface, but not one that another part leads to
const CHUNK = 2 ** 16, MOST_CELLS = 2 ** 23; // points to evaluate at once, and in all
const NEWTON_STEPS = 2, SETTLED = 0.1; // sides of a cell
const LEAST = 50; // settled vertices of a part that is no speck

/** Fills the value, negative inside, and the gradient of rows of SAMPLE floats.
 * @typedef {(rows: Float32Array) => void} Fill */

/** Returns faces counter-clockwise from outside. slack: by which the value differs at most from a distance to the
 * surface. Throws TrainingError if there is no surface, or one that is too large.
 * @param {Fill} evaluate @param {number} resolution cells along each side of the grid, 8 to 512 */
export function isosurface(evaluate, resolution, slack = 0) {
    const stride = resolution + 1, steps = [1, stride, stride * stride], side = 2 * EXTENT / resolution;
    const offsets = Array.from({length: 8}, (_, i) => steps.reduce((sum, step, k) => sum + (i >> k & 1) * step, 0));
    /** @param {number} key @param {number} k */
    const place = (key, k) => Math.floor(key / steps[k]) % stride * side - EXTENT;
    const values = new Map(), indices = new Map();
    const positions = /** @type {number[]} */ ([]), faces = /** @type {number[]} */ ([]);
    const measure = (/** @type {number[]} */ cells) => {
        const missing = [];
        for (const cell of cells) {
            for (const offset of offsets) {
                if (values.has(cell + offset)) continue;
                values.set(cell + offset, NaN);
                missing.push(cell + offset);
            }
        }
        if (values.size > MOST_CELLS) throw new TrainingError("the surface is too large; choose a coarser grid");
        for (const keys of inChunks(missing)) {
            const rows = evaluated(evaluate, keys.length, (i, k) => place(keys[i], k));
            keys.forEach((key, i) => values.set(key, closed(rows.subarray(SAMPLE * i), SNAP * side)));
        }
    };
    /** @param {number} cell @param {number} edge */
    const vertexAt = (cell, edge) => {
        const lower = cell + offsets[Math.floor(edge / 3)], axis = edge % 3, key = 3 * lower + axis;
        let index = indices.get(key);
        if (index === undefined) {
            indices.set(key, index = indices.size);
            const one = values.get(lower), share = one / (one - values.get(lower + steps[axis]));
            for (let k = 0; k < 3; ++k) positions.push(place(lower, k) + (k === axis ? share * side : 0));
        }
        return index;
    };
    const keyOf = (/** @type {number[]} */ cell) => cell.reduce((sum, n, k) => sum + n * steps[k], 0);
    const reached = new Set(seeds(evaluate, resolution, slack).map(keyOf));
    for (let cells = [...reached]; cells.length;) {
        measure(cells);
        const more = [];
        for (const cell of cells) {
            const kind = offsets.reduce((bits, offset, i) => values.get(cell + offset) < 0 ? bits | 1 << i : bits, 0);
            for (const edge of CELL_KINDS[kind].triangles) faces.push(vertexAt(cell, edge));
            for (const face of CELL_KINDS[kind].onward) {
                const neighbor = cell + face.side * steps[face.axis];
                if (!reached.has(neighbor)) more.push(neighbor);
                reached.add(neighbor);
            }
        }
        cells = more;
    }
    if (!faces.length) throw new TrainingError("there is no surface");
    return withoutSpecks(onSurface(evaluate, positions, side), faces);
}

/** Returns cells, as [x, y, z], that are near the surface: one of each block that it may cross.
 * @param {Fill} evaluate @param {number} resolution @param {number} slack */
function seeds(evaluate, resolution, slack) {
    const side = 2 * EXTENT / resolution;
    let size = 2 ** Math.max(Math.ceil(Math.log2(resolution / BLOCKS)), Math.log2(SEED));
    const count = Math.ceil(resolution / size);
    const ofCount = (/** @type {number} */ i) => [0, 1, 2].map((k) => Math.floor(i / count ** k) % count * size);
    let blocks = Array.from({length: count ** 3}, (_, i) => ofCount(i));
    for (;; size /= 2) {
        const near = /** @type {number[][]} */ ([]), radius = size * side * Math.sqrt(3) / 2;
        for (const part of inChunks(blocks)) {
            const rows = evaluated(evaluate, part.length, (i, k) => (part[i][k] + size / 2) * side - EXTENT);
            part.forEach((block, i) => {
                const [x, y, z, , value, ...gradient] = rows.subarray(SAMPLE * i, SAMPLE * i + GRADIENT + 3);
                if (!(Math.abs(value) <= STEEPEST * radius + slack && Math.hypot(x, y, z) <= EXTENT + radius)) return;
                near.push(
                    size > SEED ? block : newtonStep([x, y, z], value, gradient)
                        .map((c) => Math.min(Math.max(Math.floor((c + EXTENT) / side), 0), resolution - 1)),
                );
            });
        }
        if (size === SEED) return near;
        blocks = near.flatMap((block) => (
            Array.from({length: 8}, (_, i) => block.map((n, k) => n + (i >> k & 1) * size / 2))
        ));
    }
}

/** @template T @param {T[]} list */
function inChunks(list) {
    return Array.from({length: Math.ceil(list.length / CHUNK)}, (_, i) => list.slice(i * CHUNK, (i + 1) * CHUNK));
}

/** @param {Fill} evaluate @param {number} count @param {(i: number, k: number) => number} coordinate */
function evaluated(evaluate, count, coordinate) {
    const rows = new Float32Array(SAMPLE * count);
    for (let i = 0; i < count; ++i) for (let k = 0; k < 3; ++k) rows[SAMPLE * i + k] = coordinate(i, k);
    evaluate(rows);
    return rows;
}

/** The value at a vertex of the grid, so that the surface is closed and has no triangles without area: positive outside
 * the ball, and at least `least` from zero. @param {Float32Array} row @param {number} least */
function closed(row, least) {
    const outside = Math.hypot(row[0], row[1], row[2]) - EXTENT, value = Math.max(row[VALUE], outside);
    if (value <= -least) return value;
    return value < 0 && outside < -least ? -least : value > least ? value : least;
}

/** @param {number[]} point @param {number} value @param {number[]} gradient */
function newtonStep(point, value, gradient) {
    const squared = gradient.reduce((sum, g) => sum + g * g, 1e-12);
    return point.map((c, k) => c - value * gradient[k] / squared);
}

/** Moves vertices onto the surface, by less than a cell, and finds normals. isSettled: 1 for vertices that reach it.
 * @param {Fill} evaluate @param {number[]} positions @param {number} side */
function onSurface(evaluate, positions, side) {
    const vertices = Float32Array.from(positions), normals = new Float32Array(positions.length);
    const count = positions.length / 3, isSettled = new Uint8Array(count);
    for (let start = 0; start < count; start += CHUNK) {
        for (let step = 0; step < NEWTON_STEPS; ++step) {
            const rows = evaluated(evaluate, Math.min(CHUNK, count - start), (i, k) => vertices[3 * (start + i) + k]);
            for (let i = start, at = 0; at < rows.length; ++i, at += SAMPLE) {
                const [x, y, z, , value, ...gradient] = rows.subarray(at, at + GRADIENT + 3);
                const length = Math.hypot(...gradient);
                normals.set(gradient.map((g) => g / (length || 1)), 3 * i);
                isSettled[i] = Number(Math.abs(value) < SETTLED * side * length);
                if (Math.abs(value) < side * length) vertices.set(newtonStep([x, y, z], value, gradient), 3 * i);
            }
        }
    }
    return {vertices, normals, isSettled};
}

/** Drops the parts with fewer than LEAST settled vertices: specks, which a network's ripples make, and jumps where a
 * level ends. Keeps all if there are no others.
 * @param {ReturnType<typeof onSurface>} surface @param {number[]} faces */
function withoutSpecks({vertices, normals, isSettled}, faces) {
    const parent = Uint32Array.from(isSettled, (_, i) => i), settled = new Uint32Array(parent.length);
    const rootOf = (/** @type {number} */ i) => {
        while (parent[i] !== i) i = parent[i] = parent[parent[i]];
        return i;
    };
    for (let i = 0; i < faces.length; ++i) parent[rootOf(faces[i])] = rootOf(faces[i - i % 3]);
    isSettled.forEach((is, i) => {
        settled[rootOf(i)] += is;
    });
    const isKept = Array.from(parent, (_, i) => settled[rootOf(i)] >= LEAST);
    /** @type {number[]} */
    const places = [];
    if (!isKept.includes(true)) isKept.fill(true);
    let count = 0;
    for (const is of isKept) places.push(is ? count++ : -1);
    const ofVertex = (/** @type {number} */ _, /** @type {number} */ i) => isKept[Math.floor(i / 3)];
    return {
        vertices: vertices.filter(ofVertex),
        normals: normals.filter(ofVertex),
        faces: Uint32Array.from(faces.filter((i) => isKept[i]), (i) => places[i]),
    };
}
