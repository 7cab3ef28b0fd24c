import {shared} from "./facts.js";
import {firstValue, isNear} from "./reference.js";

// Finds the cells of a grid that the surface cannot meet, which rays skip, as codegen/reference/cells.py does.
const SLICE = 12; // milliseconds of work after which the page may do something else
const DEAR = 50000; // weights of a model whose grid is coarser, since finding it would take seconds

// Resolves to {count, half, grids}, as Cells in cells.py describes them; null where isWanted() has become false, and of a
// scene, whose rays skip what is outside its shapes' balls. rest() resolves when the next slice of the work may begin.
export async function emptyCells(model, isWanted, rest) {
    if (model.field) return null;
    const {first, least, most, moments, overestimate} = shared.cells, moves = model.inputs === "xyzt";
    const count = moves || model.parameters > DEAR ? least : most, half = 1 + model.levels[0].delta;
    let began = performance.now();
    const isDue = () => performance.now() - began >= SLICE;
    const goOn = async () => {
        await rest();
        began = performance.now();
        return isWanted();
    };
    const all = Array.from({length: first ** 3}, (_, cell) => cell);
    const middle = (cell, edge) => [cell % edge, Math.floor(cell / edge) % edge, Math.floor(cell / edge / edge)]
        .map((i) => Math.fround(((2 * i + 1) / edge - 1) * half));
    const times = moves ? Array.from({length: moments}, (_, k) => (k + 0.5) / moments) : [0], changes = [];
    let before = null;
    for (const time of moves ? times : []) {
        const values = [];
        for (const cell of all) {
            const point = middle(cell, first);
            if (Math.hypot(...point) < half) values.push(firstValue(model, point, time));
            if (isDue() && !await goOn()) return null;
        }
        if (before) changes.push(values.reduce((most, value, i) => Math.max(most, Math.abs(value - before[i])), 0));
        before = values;
    }
    const grids = [];
    for (const [k, time] of times.entries()) {
        const slack = moves ? 0.5 * overestimate * Math.max(changes[k - 1] ?? 0, changes[k] ?? 0) : 0;
        let cells = all;
        for (let edge = first; ; edge *= 2) {
            const reach = Math.fround(overestimate * Math.sqrt(3) * half / edge + slack), near = [];
            for (const cell of cells) {
                if (isNear(model, middle(cell, edge), time, edge === count, reach)) near.push(cell);
                if (isDue() && !await goOn()) return null;
            }
            cells = near;
            if (edge === count) break;
            cells = near.flatMap((cell) => {
                const x = 2 * (cell % edge), y = 2 * (Math.floor(cell / edge) % edge), z = 2 * Math.floor(cell / edge / edge);
                return [0, 1, 2, 3, 4, 5, 6, 7].map((k) => x + (k & 1) + 2 * edge * (y + (k >> 1 & 1) + 2 * edge * (z + (k >> 2))));
            });
        }
        grids.push(sizesOf(cells, count));
    }
    return {count, half, grids};
}

// Returns the index of the grid for a time from 0 to 1.
export const momentOf = ({grids}, time) => Math.min(Math.floor(time * grids.length), grids.length - 1);

// Returns the sizes of a grid in which some cells are occupied.
function sizesOf(occupied, count) {
    const sizes = new Uint8Array(count ** 3).fill(1);
    let full = new Uint8Array(count ** 3);
    for (const cell of occupied) sizes[cell] = +!(full[cell] = 1);
    for (let power = 1, side = count / 2; side >= 1; ++power, side /= 2) {
        const coarser = new Uint8Array(side ** 3);
        full.forEach((isFull, cell) => {
            if (isFull) coarser[blockOf(cell, 2 * side, 1)] = 1;
        });
        for (let cell = 0; cell < sizes.length; ++cell)
            if (!coarser[blockOf(cell, count, power)]) sizes[cell] = power + 1;
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
