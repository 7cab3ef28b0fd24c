import {element} from "./messages.js";

// Gives the shape on the stage and the kernel to all of its workers, once. shape: see state.js.
export async function loadTeam(shape) {
    shape.loading ??= toWorkers(shape);
    await shape.loading;
}

async function toWorkers({team, read}) {
    const wasm = Uint8Array.from(atob(element("kernel").textContent), (letter) => letter.charCodeAt(0));
    const module = await WebAssembly.compile(wasm);
    await team.all("load", () => ({module, read}));
}
