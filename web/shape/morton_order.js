import {SAMPLE} from "../kernel/kernel.js";

// An order of places in which each is near the one before: along Morton's curve through the cube.
const CELLS = 1024, MOST_ROWS = 2 ** 22; // cells along an edge; CELLS ** 3 * MOST_ROWS numbers are exact

/** Returns the first places of rows of samples in model space, in that order. @param {Float32Array} rows */
export function nearbyInTurn(rows) {
    const keys = new Float64Array(rows.length / SAMPLE);
    for (let i = 0; i < keys.length; ++i) {
        let cell = 0;
        for (let k = 0; k < 3; ++k) {
            cell |= apart(Math.min(CELLS - 1, Math.max(0, (rows[SAMPLE * i + k] + 1) * CELLS / 2))) << k;
        }
        keys[i] = cell * MOST_ROWS + i;
    }
    return keys.sort().map((key) => SAMPLE * (key % MOST_ROWS));
}

/** Returns a number with two zeros after each bit of a number below CELLS. @param {number} number */
function apart(number) {
    number = (number | number << 16) & 0x030000FF;
    number = (number | number << 8) & 0x0300F00F;
    number = (number | number << 4) & 0x030C30C3;
    return (number | number << 2) & 0x09249249;
}
