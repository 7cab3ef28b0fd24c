import {FOCAL, matrix} from "./camera.js";
import {Device} from "./device.js";
import {Passes, POINTS_UNIT} from "./passes.js";
import {packed, wanted} from "./samples.js";

// Draws pictures tile by tile. The model's shaders draw one sample of each pixel to a small target, which is added to
// the picture, the mean of its samples in linear light.
/** @import {Pack} from "./samples.js"
 * @import {Uniforms} from "./uniforms.js"
 * @typedef {[x: number, y: number, width: number, height: number]} Tile
 * @typedef {{tiles: (Tile | Pack)[], values: Uniforms}} Pass One sample of all or some pixels: the remaining tiles, and
 * the uniforms */
const TILE_SIDE = 512; // pixels, of the small target
const BATCH = 20; // milliseconds of drawing in one batch

export class Painter {
    /** @type {Promise<unknown>} */ queue = Promise.resolve();
    /** @type {Device} */ device;
    /** @type {Program} */ accumulate;
    /** @type {Program} */ present;
    /** @type {Program} */ contrast;
    /** @type {Program} */ scatter;
    /** @type {WebGLTexture} */ places;
    /** @type {Target} */ tile;
    /** @type {Passes} */ passes;

    /** @param {HTMLCanvasElement} canvas @param {(name: string) => string} source text of a GLSL file in the page */
    constructor(canvas, source) {
        this.canvas = canvas;
        this.source = source;
        this.open();
    }

    /** Returns a GLSL file with its includes inserted, each once. @param {string} name @returns {string} */
    shader(name, seen = new Set()) {
        if (seen.has(name)) return "";
        seen.add(name);
        return this.source(name).replace(/^#include "(.*)"\n/gm, (_, other) => this.shader(other, seen));
    }

    // Creates all objects of the context; call again after a lost context. Where it is lost meanwhile, there are none.
    open() {
        const device = this.device = new Device(this.canvas);
        const opening = "#version 300 es\nprecision highp float; precision highp int; precision highp sampler2D;\n";
        /** @param {string} name @param {string} [vertices] */
        const program = (name, vertices) => device.finish(device.begin(opening + this.shader(name), vertices));
        const target = () => device.target(device.sampleFormat, TILE_SIDE, TILE_SIDE, device.gl.NEAREST);
        try {
            Object.assign(this, {
                accumulate: program("accumulate.glsl"),
                present: program("present.glsl"),
                contrast: program("contrast.glsl"),
                scatter: program("scatter.glsl", this.vertexShader("scatter")),
                places: device.texture(device.gl.RG32F, TILE_SIDE, TILE_SIDE, device.gl.NEAREST),
                tile: target(),
                passes: new Passes(device, target),
            });
        } catch (error) {
            if (!device.lost) throw error;
        }
    }

    /** Calls `work` after all previous work; returns its promise.
     * @template T @param {() => T | Promise<T>} work @returns {Promise<T>} */
    exclusively(work) {
        const turn = this.queue.then(work);
        this.queue = turn.catch(() => {});
        return turn;
    }

    /** Returns `picture` if it has the size; else replaces it. @param {Target | null} picture @param {number[]} size */
    sized(picture, [width, height]) {
        if (picture && picture.width === width && picture.height === height) return picture;
        if (picture) this.device.release(picture);
        return this.device.target(this.device.pictureFormat, width, height, this.device.gl.LINEAR);
    }

    /** Returns the side of a tile. cost: milliseconds per pixel, 0 if unknown. @param {number} cost */
    side(cost) {
        const pixels = cost ? BATCH / cost : 4096;
        return Math.min(TILE_SIDE, Math.max(32, 2 ** Math.floor(Math.log2(Math.sqrt(pixels)))));
    }

    /** Returns the tiles [x, y, width, height] of a picture, from the center outwards. cost: see side().
     * @param {number[]} size @param {number} cost */
    tiles([width, height], cost) {
        /** @type {Tile[]} */ const tiles = [], side = this.side(cost);
        for (let y = 0; y < height; y += side)
            for (let x = 0; x < width; x += side)
                tiles.push([x, y, Math.min(side, width - x), Math.min(side, height - y)]);
        const far = (/** @type {Tile} */ [x, y]) => Math.hypot(x + side / 2 - width / 2, y + side / 2 - height / 2);
        return tiles.sort((a, b) => far(a) - far(b));
    }

    /** Returns wanted() of a picture with one sample of every pixel. @param {Target} picture @param {number} samples */
    async wanted(picture, samples) {
        const {gl} = this.device, {width, height} = picture, {program} = this.contrast;
        const target = this.device.target(gl.RGBA8, width, height, gl.NEAREST),
            seen = new Uint8Array(4 * width * height);
        gl.useProgram(program);
        gl.bindTexture(gl.TEXTURE_2D, picture.texture);
        gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
        gl.viewport(0, 0, width, height);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        await this.device.done();
        gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, seen);
        this.device.release(target);
        return wanted(seen, samples);
    }

    /** Returns the packs of one further sample of some pixels. offset, cost: see packed() and side().
     * @param {number[]} pixels @param {Target} picture @param {number[]} offset @param {number} cost */
    packs(pixels, {width}, offset, cost) {
        return packed(pixels, width, offset, this.side(cost));
    }

    /** Draws and removes tiles of a pass for about the time of a batch. Returns the milliseconds. share: weight of
     * this sample in the picture's mean.
     * @param {Variant} variant @param {Pass} pass @param {Target} picture @param {number} share */
    async batch(variant, {tiles, values}, picture, share) {
        const start = performance.now();
        let pixels = 0;
        do {
            const next = /** @type {Tile | Pack} */ (tiles.shift());
            pixels += "places" in next ?
                this.drawPack(variant, values, next, picture, share)
                : this.drawTile(variant, values, next, picture, share);
        } while (tiles.length && variant.cost && pixels * variant.cost < BATCH);
        await this.device.done();
        const milliseconds = performance.now() - start, cost = milliseconds / pixels;
        variant.cost = variant.cost ? 0.7 * variant.cost + 0.3 * cost : cost;
        return milliseconds;
    }

    /** Draws a tile or a pack, adds it to the picture, and returns its number of pixels.
     * @param {Variant} variant @param {Uniforms} values @param {Tile} tile @param {Target} picture
     * @param {number} share */
    drawTile(variant, values, [x, y, width, height], picture, share) {
        this.draw(variant, values, [x, y], [width, height]);
        this.add(picture, [x, y], [width, height], share);
        return width * height;
    }

    /** @param {Variant} variant @param {Uniforms} values @param {Pack} pack @param {Target} picture
     * @param {number} share */
    drawPack(variant, values, {width, height, places}, picture, share) {
        const {gl} = this.device;
        gl.bindTexture(gl.TEXTURE_2D, this.places);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RG, gl.FLOAT, places);
        this.draw(variant, {...values, scattered: 1}, [0, 0], [width, height]);
        this.spread(picture, [width, height], share);
        return width * height;
    }

    /** Draws a rectangle of the picture's sample to [column, row] of the small target.
     * @param {Variant} variant @param {Uniforms} values @param {number[]} place @param {[number, number]} size */
    draw(variant, values, [x, y], size, [column, row] = [0, 0]) {
        const uniforms = {scattered: 0, ...values, origin: [x - column, y - row]};
        this.passes.draw(variant, uniforms, [column, row, ...size], this);
    }

    /** @param {string} name */
    vertexShader(name) {
        return `#version 300 es\nprecision highp sampler2D;\n${this.shader(`${name}.vert.glsl`)}`;
    }

    /** Adds the small target to the picture's mean; the first sample also sets the coverage.
     * @param {Target} picture @param {number[]} place @param {number[]} size @param {number} share */
    add(picture, [x, y], [width, height], share) {
        const {gl} = this.device, {program, names} = this.accumulate;
        gl.useProgram(program);
        gl.viewport(x, y, width, height);
        gl.uniform2i(names.corner, x, y);
        gl.uniform1i(names.covered, 1);
        this.blend(picture, share, () => gl.drawArrays(gl.TRIANGLES, 0, 3));
    }

    /** Adds the samples of a pack, each to its pixel.
     * @param {Target} picture @param {number[]} size @param {number} share */
    spread(picture, [width, height], share) {
        const {gl} = this.device, {program, names} = this.scatter;
        gl.useProgram(program);
        gl.viewport(0, 0, picture.width, picture.height);
        gl.uniform1i(names.points, POINTS_UNIT);
        gl.uniform1i(names.across, width);
        gl.uniform2f(names.size, picture.width, picture.height);
        this.blend(picture, share, () => gl.drawArrays(gl.POINTS, 0, width * height));
    }

    /** Draws to a picture's mean with a weight.
     * @param {Target} picture @param {number} share @param {() => void} draw */
    blend(picture, share, draw) {
        const {gl} = this.device;
        gl.bindFramebuffer(gl.FRAMEBUFFER, picture.framebuffer);
        gl.bindTexture(gl.TEXTURE_2D, this.tile.texture);
        if (share < 1) {
            gl.enable(gl.BLEND);
            gl.blendColor(0, 0, 0, share);
            gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
        }
        draw();
        gl.disable(gl.BLEND);
    }

    /** Draws a picture to the canvas, or, as linear light, to another picture. cameras: [the picture's, the one to
     * reproject it to] (present.glsl); null: as it is.
     * @param {Target} picture @param {Target | null} onto @param {Camera[] | null} cameras */
    put(picture, onto = null, cameras = null) {
        const {gl} = this.device, {program, names} = this.present, {width, height} = onto ?? this.canvas;
        gl.useProgram(program);
        gl.bindTexture(gl.TEXTURE_2D, picture.texture);
        gl.bindFramebuffer(gl.FRAMEBUFFER, onto && onto.framebuffer);
        gl.viewport(0, 0, width, height);
        gl.uniform2f(names.size, width, height);
        gl.uniform1i(names.encoded, onto ? 0 : 1);
        gl.uniform1i(names.turned, cameras ? 1 : 0);
        if (cameras) {
            const [earlier, camera] = cameras.map((each) => matrix(each, width / height));
            gl.uniformMatrix4fv(names.earlier, false, earlier);
            gl.uniformMatrix4fv(names.camera, false, camera);
            gl.uniform1f(names.focal, FOCAL);
        }
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    /** Returns the red channel of the first `count` pixels of the small target. @param {number} count */
    reds(count) {
        const {gl} = this.device, pixels = new Float32Array(4 * count);
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.tile.framebuffer);
        gl.readPixels(0, 0, count, 1, gl.RGBA, gl.FLOAT, pixels);
        return pixels.filter((_, i) => i % 4 === 0);
    }
}
