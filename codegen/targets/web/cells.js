import {shared} from "./facts.js";
import {isNear} from "./reference.js";

// Finds the cells of a grid that the surface cannot meet, which rays skip, as codegen/reference/cells.py does.
const SLICE = 12; // milliseconds of work after which the page may do something else
const DEAR = 50000; // weights of a model whose grid is coarser, since finding it would take seconds

// Resolves to {count, half, sizes}, as Cells in cells.py describes them; null for a field that moves, and where
// isWanted() has become false. rest() resolves when the next slice of the work may begin.
export async function emptyCells(model, isWanted, rest) {
    if (model.inputs === "xyzt") return null;
    const count = model.parameters > DEAR ? shared.cells.least : shared.cells.most, half = 1 + model.levels[0].delta;
    let cells = [], began = performance.now();
    for (let k = 0; k < shared.cells.first ** 3; ++k) cells.push(k);
    for (let edge = shared.cells.first; ; edge *= 2) {
        const reach = Math.fround(shared.cells.overestimate * Math.sqrt(3) * half / edge), near = [];
        for (const cell of cells) {
            const place = [cell % edge, Math.floor(cell / edge) % edge, Math.floor(cell / edge / edge)];
            const point = place.map((i) => Math.fround(((2 * i + 1) / edge - 1) * half));
            if (isNear(model, point, edge === count, reach)) near.push(cell);
            if (performance.now() - began < SLICE) continue;
            await rest();
            if (!isWanted()) return null;
            began = performance.now();
        }
        if (edge === count) return {count, half, sizes: sizesOf(near, count)};
        cells = near.flatMap((cell) => {
            const x = 2 * (cell % edge), y = 2 * (Math.floor(cell / edge) % edge), z = 2 * Math.floor(cell / edge / edge);
            return [0, 1, 2, 3, 4, 5, 6, 7].map((k) => x + (k & 1) + 2 * edge * (y + (k >> 1 & 1) + 2 * edge * (z + (k >> 2))));
        });
    }
}

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
