import {watchDensity} from "../draw/device.js";

// Which elements of a page draw. A browser keeps some 16 graphics contexts, 8 on phones; a further one costs another element
// its own. So MOST elements draw at once. Where others wait, one that has drawn its picture rests, and keeps the picture.
const MOST = 8;
/** @typedef {{open: () => void, rest: () => void, resize: () => void, idleness: () => number}} Drawing of an element.
 * rest: gives the context back; idleness: 2 out of view, 1 with a picture, 0 in use */
/** @type {Set<Drawing>} */
const drawing = new Set(), /** @type {Set<Drawing>} */ waiting = new Set(); // those that came first are first

if ("matchMedia" in globalThis) watchDensity(() => drawing.forEach((one) => one.resize())); // else on a server

/** Calls open() in the element's turn. @param {Drawing} one */
export function askToDraw(one) {
    if (!drawing.has(one)) waiting.add(one);
    giveTurns();
}

/** The element draws no more, and waits no more. @param {Drawing} one */
export function endDrawing(one) {
    waiting.delete(one);
    if (drawing.delete(one)) queueMicrotask(giveTurns);
}

export function giveTurns() {
    for (const one of waiting) {
        if (drawing.size >= MOST) {
            const [idlest] = [...drawing].sort((a, b) => b.idleness() - a.idleness());
            if (!idlest.idleness()) return;
            idlest.rest();
        }
        waiting.delete(one);
        drawing.add(one);
        one.open();
    }
}
