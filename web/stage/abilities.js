import {kernelBytes} from "../train/loading.js";

/** Returns a line that says what this browser lacks for a training, and what to do; an empty text where it lacks
 * nothing. Without WebGL2, the page invites nobody (web/view/page.css). */
export function lacking() {
    const {WebAssembly: wasm, Worker: worker} = globalThis;
    const missing = !wasm
        ? "WebAssembly"
        : !worker
        ? "workers"
        : !wasm.validate(kernelBytes())
        ? "WebAssembly SIMD"
        : "";
    return missing && `This browser has no ${missing}, which a training needs. Models can be viewed here. `
            + "To train, try a current Firefox, Chrome, Edge or Safari.";
}
