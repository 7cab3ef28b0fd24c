import {shared} from "../model/facts.js";
import {widenedValues} from "../print/reference.js";

// Computes the grid of cells that lets rays skip empty space, as field/cells.py.
const SLICE = 12; // milliseconds of work between pauses
const AT_ONCE = 16; // points that are evaluated together
const EIGHT = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [k & 1, k >> 1 & 1, k >> 2]); // offsets of a block of eight

/** Returns the resolutions of a model's successive grids: fast and coarse ones first. A scene has none; its rays skip
 * by the bounding balls of its shapes.
 * @param {Model} model */
export function countsOf(model) {
    if (model.field || model.isUnfinished) return [];
    const {counts: {first, second, last}, many, too_many: tooMany} = shared.cells;
    if (model.inputs === "xyzt") return [first];
    return [first, ...(model.parameters > many ? [second] : []), ...(model.parameters > tooMany ? [] : [last])];
}

/** @typedef {{isDue: () => boolean, goOn: () => Promise<boolean>}} Pace of the work: whether a pause is due */

/** Resolves to null once isWanted() is false. rest(): resolves when the next slice of work may begin.
 * @param {Model} model @param {number} count @param {() => boolean} isWanted @param {() => Promise<unknown>} rest
 * @returns {Promise<Cells | null>} */
export async function emptyCells(model, count, isWanted, rest) {
    const {moments, overestimate} = shared.cells, moves = model.inputs === "xyzt", half = 1 + model.levels[0].delta;
    let began = performance.now();
    const pace = {
        isDue: () => performance.now() - began >= SLICE,
        goOn: async () => {
            await rest();
            began = performance.now();
            return isWanted();
        },
    };
    const times = moves ? Array.from({length: moments}, (_, k) => k / (moments - 1)) : [0];
    const excesses = moves ? await excessesBetween(model, times, half, pace) : [], grids = [];
    for (const [k, time] of times.entries()) {
        const slack = moves ? overestimate * Math.max(excesses?.[k - 1] ?? 0, excesses?.[k] ?? 0) : 0;
        const grid = excesses && await gridAt(model, time, {count, half, slack}, pace);
        if (!grid) return null;
        grids.push(grid);
    }
    return {count, half, grids};
}

/** Returns the grid for a time from 0 to 1, interpolated as by mixed() in cell_codes.py.
 * @param {Cells} cells @param {number} time */
export function gridOf({grids}, time) {
    if (grids.length === 1) return grids[0];
    const place = time * (grids.length - 1),
        first = Math.min(Math.floor(place), grids.length - 2),
        share = place - first;
    const {empty} = shared.cells, before = grids[first], after = grids[first + 1];
    const values = Float64Array.from({length: 256}, (_, code) => valueOf(code));
    return before.map((code, cell) => {
        const other = after[cell];
        if (code === empty || other === empty) return empty;
        if (code < empty && other < empty) return Math.min(code, other);
        return coded((1 - share) * values[code] + share * values[other]);
    });
}

/** @type {(i: number, edge: number, half: number) => number} */
const at = (i, edge, half) => Math.fround((2 * i / edge - 1) * half);
/** @param {number} cell @param {number} edge */
const placeOf = (cell, edge) => [cell % edge, Math.floor(cell / edge) % edge, Math.floor(cell / edge / edge)];
/** @type {(cell: number, edge: number, half: number) => Vector} */
const middle = (cell, edge, half) => placeOf(cell, edge).map((i) => at(i + 0.5, edge, half));
const everyCell = (/** @type {number} */ edge) => Array.from({length: edge ** 3}, (_, cell) => cell);

/** Resolves to the excess between each two successive times, as Cells._slack in cells.py; null once isWanted() is
 * false.
 * @param {Model} model @param {number[]} times @param {number} half @param {Pace} pace */
async function excessesBetween(model, times, half, pace) {
    const {first} = shared.cells, excesses = times.slice(1).fill(0), step = times[1], [{delta}] = model.levels;
    for (const cell of everyCell(first)) {
        const point = middle(cell, first, half);
        if (Math.hypot(...point) >= half) continue;
        const at = (/** @type {number} */ time) => widenedValues(model, [point], time, 0, 1)[0], values = times.map(at);
        excesses.forEach((most, k) => {
            const [before, after] = [values[k], values[k + 1]];
            const bend = 0.5 * (before + after) - at(times[k] + 0.5 * step);
            excesses[k] = Math.max(most, bend, Math.abs(after - before) - delta);
        });
        if (pace.isDue() && !await pace.goOn()) return null;
    }
    return excesses;
}

/** Resolves to the values of the first `depth` levels at the places of items, see widenedValues(), or null.
 * @param {Model} model @param {number[]} items @param {(item: number) => Vector} placeOf
 * @param {{time: number, margin: number, depth?: number}} band @param {Pace} pace */
async function valuesOf(model, items, placeOf, {time, margin, depth}, pace) {
    const values = new Float64Array(items.length);
    for (let start = 0; start < items.length; start += AT_ONCE) {
        const points = items.slice(start, start + AT_ONCE).map(placeOf);
        values.set(widenedValues(model, points, time, margin, depth), start);
        if (pace.isDue() && !await pace.goOn()) return null;
    }
    return values;
}

/** Resolves to the grid for a time, or null.
 * @param {Model} model @param {number} time @param {{count: number, half: number, slack: number}} cube
 * @param {Pace} pace */
async function gridAt(model, time, {count, half, slack}, pace) {
    const {first, overestimate, reach} = shared.cells, {levels} = model, scale = 0.5 * count / half;
    let cells = everyCell(first);
    for (let edge = first; edge < count; edge *= 2) {
        const near = levels[0].delta + overestimate * Math.sqrt(3) * half / edge + slack;
        const values = await valuesOf(
            model,
            cells,
            (cell) => middle(cell, edge, half),
            {time, margin: 0, depth: 1},
            pace,
        );
        if (!values) return null;
        cells = cells.filter((_, k) => Math.abs(values[k]) < near).flatMap((cell) => {
            const [x, y, z] = placeOf(cell, edge);
            return EIGHT.map(([i, j, k]) => 2 * x + i + 2 * edge * (2 * y + j + 2 * edge * (2 * z + k)));
        });
    }
    const margin = reach / scale + slack, bound = levels.at(-1).bounds.step_bound;
    const found = await valuesOf(model, cells, (cell) => middle(cell, count, half), {time, margin}, pace);
    if (!found) return null;
    /** @type {number[]} */ const occupied = [], /** @type {number[]} */ values = [];
    cells.forEach((cell, k) => {
        if (!(found[k] < margin)) return;
        occupied.push(cell);
        values.push((found[k] > 0 ? bound : 1) * found[k] - slack);
    });
    const grid = sizesOf(occupied, count), codeValues = Float64Array.from({length: 256}, (_, code) => valueOf(code));
    const steps = EIGHT.map(([i, j, k]) => i + count * (j + count * k)); // from a corner back to the cells around it
    const isCorner = new Uint8Array(count ** 3), lowered = new Float32Array(count ** 3);
    occupied.forEach((cell, i) => {
        grid[cell] = coded(scale * values[i]);
        if (Math.abs(values[i]) >= reach / scale) return;
        for (const step of steps) isCorner[cell + step] = 1;
    });
    const between = (/** @type {number} */ corner) =>
        steps.reduce((sum, step) => sum + codeValues[grid[corner - step]], 0) / 8;
    const isInside = (/** @type {number} */ corner) => placeOf(corner, count).every((k) => k > 0);
    const corners = [];
    for (let corner = 0; corner < count ** 3; ++corner)
        if (isCorner[corner] && isInside(corner) && between(corner) > 0) corners.push(corner);
    const placeAt = (/** @type {number} */ corner) => placeOf(corner, count).map((k) => at(k, count, half));
    const theirs = await valuesOf(model, corners, placeAt, {time, margin}, pace);
    if (!theirs) return null;
    corners.forEach((corner, i) => {
        const excess = between(corner) - Math.min(scale * (theirs[i] - slack), reach);
        for (const step of steps) lowered[corner - step] = Math.max(lowered[corner - step], excess);
    });
    for (const cell of occupied) grid[cell] = coded(codeValues[grid[cell]] - shared.cells.missed * lowered[cell]);
    return grid;
}

/** Returns the value of a byte, in edges of a cell. @param {number} code */
function valueOf(code) {
    const {empty, reach} = shared.cells, levels = (255 - empty) / 2;
    return code < empty ? reach : (code - empty - levels) / levels * reach;
}

/** Returns the byte of a value of an occupied cell, rounded down. @param {number} value */
function coded(value) {
    const {empty, reach} = shared.cells, levels = (255 - empty) / 2;
    return Math.min(Math.max(Math.floor(empty + levels + value / reach * levels + 1e-4), empty), 255);
}

/** Returns the empty-cube sizes of a grid with some occupied cells. @param {number[]} occupied @param {number} count */
function sizesOf(occupied, count) {
    const powers = Array.from({length: Math.log2(count) + 1}, (_, power) => power),
        of = (/** @type {number} */ k, /** @type {number} */ power) => k >> power;
    const full = powers.map((power) => new Uint8Array(of(count, power) ** 3));
    for (const cell of occupied) {
        const [x, y, z] = placeOf(cell, count);
        for (const power of powers) {
            const side = of(count, power);
            full[power][of(x, power) + side * (of(y, power) + side * of(z, power))] = 1;
        }
    }
    let sizes = new Uint8Array(1);
    for (const power of powers.reverse()) {
        const side = of(count, power), finer = new Uint8Array(side ** 3), half = side >> 1;
        for (let z = 0, cell = 0; z < side; ++z)
            for (let y = 0; y < side; ++y)
                for (let x = 0; x < side; ++x, ++cell)
                    finer[cell] = sizes[(x >> 1) + half * ((y >> 1) + half * (z >> 1))] ||
                        (full[power][cell] ? 0 : power);
        sizes = finer;
    }
    return sizes;
}
