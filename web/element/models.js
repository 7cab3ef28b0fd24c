import {lowestPoint} from "../draw/lowest_point.js";
import {facts} from "../model/facts.js";
import {ModelError, parseModel} from "../model/safetensors.js";
import {bakedScene} from "../print/baked_scene.js";

// The models of a page's elements: those in the modules, by name, and those in files.
/** @type {ShownModel | null} */ let baked = null;

/** Returns the model in this module. @returns {ShownModel} */
export function ownModel() {
    if (baked) return baked;
    const {buffer} = Uint8Array.from(atob(facts.weights), (letter) => letter.charCodeAt(0));
    const model = facts.scene ? bakedScene(facts, buffer) : parseModel(buffer, true);
    return (baked = {...model, ground: facts.ground, poster: facts.poster});
}

/** Resolves to the model in a file. signal: of an AbortController. Throws ModelError, which names the file.
 * @param {string | URL} url @param {AbortSignal | null} signal */
export async function loadModel(url, signal = null) {
    try {
        const answer = await fetch(url, {signal}), {status} = answer;
        // HTTP/2 has no texts.
        if (!answer.ok)
            throw new ModelError(`${status} ${answer.statusText || (status === 404 ? "Not Found" : "")}`.trim());
        const model = parseModel(await answer.arrayBuffer(), true);
        return {...model, ground: lowestPoint(model), poster: null};
    } catch (error) {
        if (signal?.aborted) throw error;
        throw new ModelError(`${String(url).slice(0, 200)} cannot be loaded: ${/** @type {Error} */ (error).message}`, {
            cause: error,
        });
    }
}

/** Resolves to the model of an element: of a file, else by its name, else of the first module. src, name: attributes,
 * or null; known: the Models of the page. Calls `missing` with an error where no module of the page has it, and
 * waits for one.
 * @param {string | null} src @param {string | null} name @param {Models} known @param {AbortSignal} signal
 * @param {(error: Error) => void} missing */
export async function findModel(src, name, known, signal, missing) {
    if (src) return loadModel(src, signal);
    const named = () => name === null ? known.values().next().value : known.get(name);
    for (let isTold = false; !named(); await known.change()) {
        if (isTold || document.readyState !== "complete") continue;
        isTold = true;
        missing(new Error(`model="${name}": no module of this page has it; there is ${[...known.keys()].join(", ")}`));
    }
    return /** @type {() => ShownModel} */ (named())();
}

/** The models of the modules of a page: functions, by the names of their models. A module may come at any time.
 * @extends {Map<string, () => ShownModel>} */
export class Models extends Map {
    /** @type {((value?: unknown) => void)[]} */ #waiting = [];

    /** @override @param {string} name @param {() => ShownModel} model */
    set(name, model) {
        for (const resolve of this.#waiting.splice(0)) resolve();
        return super.set(name, model);
    }

    // Resolves with the next module, or when the page has loaded.
    change() {
        return new Promise((resolve) => {
            this.#waiting.push(resolve);
            addEventListener("load", resolve, {once: true});
        });
    }
}
