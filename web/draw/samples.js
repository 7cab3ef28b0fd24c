import {shared} from "../model/facts.js";

// Chooses the number of further samples of each pixel, as viewer/draw/adaptive.py, and packs the samples of scattered
// pixels.
const SQUARE = shared.samples.block; // texels along a side

/** Returns {pixels, counts}: indices of the pixels with further samples, in row order, and their numbers of further
 * samples. seen: four bytes per pixel from contrast.glsl. samples: largest number per pixel.
 * @param {Uint8Array} seen @param {number} samples */
export function wanted(seen, samples) {
    const bins = new Float64Array(256);
    let covered = 0;
    for (let i = 0; i < seen.length; i += 4) {
        ++bins[seen[i]];
        if (seen[i + 3]) ++covered;
    }
    const {share, plenty, power, steepest} = shared.samples;
    const count = (/** @type {number} */ byte, /** @type {number} */ steepness) => {
        const further = Math.min(Math.floor((byte / 255) ** power * steepness), samples - 1);
        return further === 1 ? 0 : further;
    };
    const isTooMuch = (/** @type {number} */ steepness) => {
        const most = share * Math.max(1, (plenty / steepness) ** 2) * (samples - 1) * covered;
        return bins.reduce((sum, many, byte) => sum + many * count(byte, steepness), 0) > most;
    };
    let low = 0, high = steepest;
    if (!isTooMuch(high)) low = high;
    for (let i = 0; i < 20 && low < high; ++i) {
        const middle = (low + high) / 2;
        if (isTooMuch(middle)) high = middle;
        else low = middle;
    }
    const table = Uint8Array.from(bins, (_, byte) => count(byte, low));
    const pixels = [];
    for (let i = 0; i < seen.length; i += 4)
        if (table[seen[i]]) pixels.push(i / 4);
    return {pixels, counts: pixels.map((pixel) => table[seen[4 * pixel]])};
}

/** @typedef {{width: number, height: number, places: Float32Array}} Pack */

/** Returns packs {width, height, places} of one further sample of pixels, in squares of SQUARE texels of a target
 * with room for `side` of them. places: for each texel a point of the picture, pixels; unused texels lie outside.
 * across: pixels per row; offset: of the sample from the pixel's center, pixels.
 * @param {number[]} pixels @param {number} across @param {number[]} offset @param {number} side */
export function packed(pixels, across, [right, up], side) {
    const packs = [], room = SQUARE * SQUARE;
    for (let start = 0; start < pixels.length; start += side * side) {
        const part = pixels.slice(start, start + side * side), blocks = Math.ceil(part.length / room);
        const row = Math.min(side / SQUARE, Math.ceil(Math.sqrt(blocks)));
        const width = SQUARE * row, height = SQUARE * Math.ceil(blocks / row);
        const places = new Float32Array(2 * width * height).fill(-1);
        part.forEach((pixel, i) => {
            const block = Math.floor(i / room), x = SQUARE * (block % row) + i % SQUARE;
            const y = SQUARE * Math.floor(block / row) + Math.floor(i % room / SQUARE);
            places.set([pixel % across + 0.5 + right, Math.floor(pixel / across) + 0.5 + up], 2 * (x + width * y));
        });
        packs.push({width, height, places});
    }
    return packs;
}
