import {readFloats} from "../model/safetensors.js";
import {TEXTURE_WIDTH} from "./texels.js";

/** Returns a page's own scene in the form of parseModel. Its levels have no networks; `field` is what printField
 * would return, printed by web/scene.py. buffer: the texels.
 * @param {Facts} facts @param {ArrayBuffer} buffer
 * @returns {Model} */
export function bakedScene({name, front = null, credit = "", scene}, buffer) {
    const {text, loops, texels: count, size, ...more} = /** @type {SceneFacts} */ (scene);
    const height = Math.ceil(count / TEXTURE_WIDTH), texels = new Float32Array(4 * TEXTURE_WIDTH * height);
    texels.set(readFloats(new DataView(buffer), 4 * count, size));
    return {name, front, credit, ...more, field: {text, texels, height, loops}};
}
