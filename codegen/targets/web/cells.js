import {shared} from "./facts.js";
import {firstValue, widenedValue} from "./reference.js";

// Finds the cells of a grid that the surface cannot meet, and how near it is to the others, for rays to skip, as
// codegen/reference/cells.py does.
const SLICE = 12; // milliseconds of work after which the page may do something else
const DEAR = 50000; // weights of a model whose grid is coarser, since finding it would take seconds
const EIGHT = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [k & 1, k >> 1 & 1, k >> 2]); // steps to a block of eight

// Resolves to {count, half, grids}, as Cells in cells.py describes them; null where isWanted() has become false, and of a
// scene, whose rays skip what is outside its shapes' balls. rest() resolves when the next slice of the work may begin.
export async function emptyCells(model, isWanted, rest) {
    if (model.field) return null;
    const {least, most, moments, overestimate} = shared.cells, moves = model.inputs === "xyzt";
    const count = moves || model.parameters > DEAR ? least : most, half = 1 + model.levels[0].delta;
    let began = performance.now();
    const pace = {
        isDue: () => performance.now() - began >= SLICE,
        goOn: async () => { // whether the work is to
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

// Returns the grid for a time from 0 to 1: the only one, or as between() in cell_codes.py has it.
export function gridOf({grids}, time) {
    if (grids.length === 1) return grids[0];
    const place = time * (grids.length - 1), first = Math.min(Math.floor(place), grids.length - 2), share = place - first;
    const {empty} = shared.cells, before = grids[first], after = grids[first + 1];
    const values = Float64Array.from({length: 256}, (_, code) => valueOf(code));
    return before.map((code, cell) => {
        const other = after[cell];
        if (code === empty || other === empty) return empty;
        if (code < empty && other < empty) return Math.min(code, other);
        return coded((1 - share) * values[code] + share * values[other]);
    });
}

const at = (i, edge, half) => Math.fround((2 * i / edge - 1) * half);
const placeOf = (cell, edge) => [cell % edge, Math.floor(cell / edge) % edge, Math.floor(cell / edge / edge)];
const middle = (cell, edge, half) => placeOf(cell, edge).map((i) => at(i + 0.5, edge, half));
const everyCell = (edge) => Array.from({length: edge ** 3}, (_, cell) => cell);

// Resolves to what level 1 makes values from each of the times to the next too large by, as Cells._slack in cells.py finds
// it; null where that was unwanted.
async function excessesBetween(model, times, half, pace) {
    const {first} = shared.cells, excesses = times.slice(1).fill(0), step = times[1], [{delta}] = model.levels;
    for (const cell of everyCell(first)) {
        const point = middle(cell, first, half);
        if (Math.hypot(...point) >= half) continue;
        const values = times.map((time) => firstValue(model, point, time));
        excesses.forEach((most, k) => {
            const [before, after] = [values[k], values[k + 1]];
            const bend = 0.5 * (before + after) - firstValue(model, point, times[k] + 0.5 * step);
            excesses[k] = Math.max(most, bend, Math.abs(after - before) - delta);
        });
        if (pace.isDue() && !await pace.goOn()) return null;
    }
    return excesses;
}

// Resolves to the grid for a time; null where it was unwanted.
async function gridAt(model, time, {count, half, slack}, pace) {
    const {first, overestimate, reach} = shared.cells, {levels} = model, scale = 0.5 * count / half;
    let cells = everyCell(first);
    for (let edge = first; edge < count; edge *= 2) {
        const near = levels[0].delta + overestimate * Math.sqrt(3) * half / edge + slack, kept = [];
        for (const cell of cells) {
            if (Math.abs(firstValue(model, middle(cell, edge, half), time)) < near) kept.push(cell);
            if (pace.isDue() && !await pace.goOn()) return null;
        }
        cells = kept.flatMap((cell) => {
            const [x, y, z] = placeOf(cell, edge);
            return EIGHT.map(([i, j, k]) => 2 * x + i + 2 * edge * (2 * y + j + 2 * edge * (2 * z + k)));
        });
    }
    const margin = reach / scale + slack, occupied = [], values = [], bound = levels.at(-1).bounds.step_bound;
    const valueAt = (point) => widenedValue(model, point, time, margin);
    for (const cell of cells) {
        const value = valueAt(middle(cell, count, half));
        if (value < margin) {
            occupied.push(cell);
            values.push((value > 0 ? bound : 1) * value - slack);
        }
        if (pace.isDue() && !await pace.goOn()) return null;
    }
    const grid = sizesOf(occupied, count), lowered = new Map();
    occupied.forEach((cell, i) => grid[cell] = coded(scale * values[i]));
    const corners = new Set();
    occupied.forEach((cell, i) => {
        const place = placeOf(cell, count);
        if (Math.abs(values[i]) >= reach / scale) return;
        for (const step of EIGHT) {
            const corner = place.map((k, axis) => k + step[axis]);
            if (corner.every((k) => k > 0 && k < count)) corners.add(corner[0] + count * (corner[1] + count * corner[2]));
        }
    });
    for (const corner of corners) {
        const place = placeOf(corner, count);
        const around = EIGHT.map(([i, j, k]) => corner - i - count * (j + count * k));
        const between = around.reduce((sum, cell) => sum + valueOf(grid[cell]), 0) / 8;
        if (between > 0) {
            const value = valueAt(place.map((k) => at(k, count, half))) - slack;
            const excess = between - Math.min(scale * value, reach);
            for (const cell of around) lowered.set(cell, Math.max(lowered.get(cell) ?? 0, excess));
        }
        if (pace.isDue() && !await pace.goOn()) return null;
    }
    for (const cell of occupied) grid[cell] = coded(valueOf(grid[cell]) - shared.cells.missed * (lowered.get(cell) ?? 0));
    return grid;
}

// Returns the value, in edges of a cell, that a byte stands for.
function valueOf(code) {
    const {empty, reach} = shared.cells, levels = (255 - empty) / 2;
    return code < empty ? reach : (code - empty - levels) / levels * reach;
}

// Returns the byte of a value of a cell that is not empty; it stands for no more.
function coded(value) {
    const {empty, reach} = shared.cells, levels = (255 - empty) / 2;
    return Math.min(Math.max(Math.floor(empty + levels + value / reach * levels + 1e-4), empty), 255);
}

// Returns the sizes of a grid in which some cells are occupied.
function sizesOf(occupied, count) {
    const sizes = new Uint8Array(count ** 3);
    let full = new Uint8Array(count ** 3);
    for (const cell of occupied) full[cell] = 1;
    for (let power = 1, side = count / 2; side >= 1; ++power, side /= 2) {
        const coarser = new Uint8Array(side ** 3);
        full.forEach((isFull, cell) => {
            if (isFull) coarser[blockOf(cell, 2 * side, 1)] = 1;
        });
        for (let cell = 0; cell < sizes.length; ++cell)
            if (!coarser[blockOf(cell, count, power)]) sizes[cell] = power;
        full = coarser;
    }
    return sizes;
}

// Returns the number of the cell of a coarser grid that a cell is in; side: of the finer one, 2 ** power times as fine.
function blockOf(cell, side, power) {
    const coarse = side >> power;
    return (cell % side >> power) + coarse * ((Math.floor(cell / side) % side >> power)
        + coarse * (Math.floor(cell / side / side) >> power));
}
