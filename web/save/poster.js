import {homeOf} from "../draw/camera.js";
import {uniforms} from "../draw/uniforms.js";
import {shared} from "../model/facts.js";
/** @import {Renderer} from "../draw/renderer.js" */

// The small picture that an exported page shows before its first frame, as of web/page.py.
const POSTER_SIDE = 160, POSTER_SAMPLES = 4, POSTER_QUALITY = 0.85;

/** Resolves to the first view of the renderer's model as a data URL, transparent beside the shape. "data:,": this
 * device cannot draw it. @param {Renderer} renderer @param {string} shading */
export function posterOf({painter, variants, scene}, shading) {
    const {device} = painter, {gl} = device;
    /** @type {[number, number]} */
    const size = [POSTER_SIDE, POSTER_SIDE];
    return painter.exclusively(async () => {
        const {current} = variants;
        if (!device.half || !current || device.lost) return "data:,";
        const length = Math.hypot(...shared.defaults.light), light = shared.defaults.light.map((c) => c / length);
        const options = {
            ...scene.options,
            light,
            shading,
            level: scene.model.levels.length,
            normalLevel: null,
            time: 0,
        };
        const view = {...scene, camera: homeOf(scene.model.front), options}, picture = painter.sized(null, size);
        for (let k = 0; k < POSTER_SAMPLES; ++k) {
            const pass = {tiles: painter.tiles(size, current.cost), values: uniforms(view, current.loops, size, k)};
            while (pass.tiles.length) await painter.batch(current, pass, picture, 1 / (k + 1));
        }
        const seen = new Float32Array(4 * POSTER_SIDE ** 2);
        gl.bindFramebuffer(gl.FRAMEBUFFER, picture.framebuffer);
        gl.readPixels(0, 0, ...size, gl.RGBA, gl.FLOAT, seen);
        device.release(picture);
        return pictureUrl(seen);
    });
}

/** @param {Float32Array} seen linear light and coverage, bottom row first */
function pictureUrl(seen) {
    const canvas = Object.assign(document.createElement("canvas"), {width: POSTER_SIDE, height: POSTER_SIDE});
    const image = new ImageData(POSTER_SIDE, POSTER_SIDE), row = 4 * POSTER_SIDE;
    const encoded = (/** @type {number} */ c) => (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);
    seen.forEach((c, i) => {
        const at = seen.length - row - i + 2 * (i % row); // the rows in reverse
        image.data[at] = 255 * (i % 4 === 3 ? c : encoded(c));
    });
    canvas.getContext("2d")?.putImageData(image, 0, 0);
    return canvas.toDataURL("image/webp", POSTER_QUALITY);
}
