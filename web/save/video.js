import {canvas, renderer, resize, viewTurned} from "../view/view.js";
import {recordTurntable} from "./recorder.js";

// Records one turn of the present view.
const SECONDS = 6, FRAMES = 24; // of the video; frames in a second
const LONGEST_DRAWING = 120; // seconds that the drawing may take; slow devices draw fewer pixels
const LARGEST_SIDE = 1080, SMALLEST_SIDE = 128; // pixels along the shorter side

/** Resolves to a WebM Blob, or null where tell(share) returned "stop". @param {(share: number) => string} tell */
export async function turntableVideo(tell) {
    const {width, height} = canvas,
        pixels = LONGEST_DRAWING * 1000 / (SECONDS * FRAMES * (renderer.variants.current?.cost || 1e-6));
    const fitting = Math.sqrt(pixels / (width * height)) * Math.min(width, height);
    const scale = Math.min(1, Math.min(LARGEST_SIDE, Math.max(SMALLEST_SIDE, fitting)) / Math.min(width, height));
    Object.assign(canvas, {width: even(width * scale), height: even(height * scale)});
    try {
        const drawAt = (/** @type {number} */ share) => renderer.frame(viewTurned(360 * share));
        return await recordTurntable(canvas, {seconds: SECONDS, fps: FRAMES, drawAt}, tell);
    } finally {
        resize();
    }
}

/** @param {number} side */
const even = (side) => 2 * Math.max(1, Math.round(side / 2));
