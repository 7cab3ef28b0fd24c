import {pause} from "../model/pause.js";
import {element} from "../view/messages.js";
/** @import {StageShape} from "../stage/state.js" */

// Returns the bytes of the kernel, a WebAssembly module.
export const kernelBytes = () => Uint8Array.from(atob(element("kernel").textContent), (letter) => letter.charCodeAt(0));

/** Gives the shape on the stage and the kernel to all of its workers, once. Resolves to the compiled kernel.
 * @param {StageShape} shape */
export function loadTeam(shape) {
    shape.loading ??= toWorkers(shape);
    return shape.loading;
}

/** @param {StageShape} shape */
async function toWorkers({team, read}) {
    const module = await WebAssembly.compile(kernelBytes());
    await Promise.all(team.workers.map(async (_, k) => {
        await pause(k); // a task for each: a large shape takes long to copy
        await team.ask(k, "load", {module, read: {...read, normals: null}}); // the facets have theirs
    }));
    return module;
}
