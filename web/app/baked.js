import {facts} from "./facts.js";
import {readFloats} from "./safetensors.js";
import {TEXTURE_WIDTH} from "./texels.js";

// Returns the scene that the page was made for, as parseModel returns a model. Its levels have no networks: `field` is
// what printField would give, printed by webpage_scene.py. buffer: the texels, one after the other.
export function bakedScene(buffer) {
    const {name, front = null, credit = "", scene: {text, loops, texels: count, size, ...more}} = facts;
    const height = Math.ceil(count / TEXTURE_WIDTH), texels = new Float32Array(4 * TEXTURE_WIDTH * height);
    texels.set(readFloats(new DataView(buffer), 4 * count, size));
    return {name, front, credit, ...more, field: {text, texels, height, loops}};
}
