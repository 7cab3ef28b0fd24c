import {Device} from "./device.js";

// Draws pictures tile by tile: one sample of each pixel by the model's shader into a small target, from there into the
// picture, which is the mean of its samples in linear light.
// A variant is what variants.js says. A pass is one sample of every pixel: {tiles yet to be drawn, values of uniforms}.
const TILE = 512;
const BATCH = 20; // milliseconds of drawing that are asked for at once

export class Painter {
    constructor(canvas, sources) {
        Object.assign(this, {canvas, sources, queue: Promise.resolve()});
        this.open();
    }

    // Makes everything that a context holds; after a lost one, again.
    open() {
        const device = new Device(this.canvas);
        const program = (source) => device.finish(device.begin(`#version 300 es\nprecision highp float;\n${source}`));
        Object.assign(this, {
            device, accumulate: program(this.sources.accumulate), present: program(this.sources.present),
            tile: device.target(device.sampleFormat, TILE, TILE, device.gl.NEAREST),
        });
    }

    // Runs `work` between two batches of drawing.
    exclusively(work) {
        const turn = this.queue.then(work);
        this.queue = turn.catch(() => {});
        return turn;
    }

    // `picture` if it has the size, else another in its place.
    sized(picture, [width, height]) {
        if (picture && picture.width === width && picture.height === height) return picture;
        if (picture) this.device.release(picture);
        return this.device.target(this.device.pictureFormat, width, height, this.device.gl.LINEAR);
    }

    // Tiles [x, y, width, height] of a picture, from the middle out. cost: milliseconds a pixel, 0 where unknown.
    tiles([width, height], cost) {
        const pixels = cost ? BATCH / cost : 4096;
        const side = Math.min(TILE, Math.max(32, 2 ** Math.floor(Math.log2(Math.sqrt(pixels)))));
        const tiles = [];
        for (let y = 0; y < height; y += side)
            for (let x = 0; x < width; x += side)
                tiles.push([x, y, Math.min(side, width - x), Math.min(side, height - y)]);
        const far = ([x, y]) => Math.hypot(x + side / 2 - width / 2, y + side / 2 - height / 2);
        return tiles.sort((a, b) => far(a) - far(b));
    }

    // Draws tiles of a pass, which then has fewer, until a batch's time is likely used up; the milliseconds it took.
    // share: of this sample in the picture's mean.
    async batch(variant, {tiles, values}, picture, share) {
        const start = performance.now();
        let pixels = 0;
        do {
            const [x, y, width, height] = tiles.shift();
            this.draw(variant, values, [x, y], [width, height]);
            this.add(picture, [x, y], [width, height], share);
            pixels += width * height;
        } while (tiles.length && variant.cost && pixels * variant.cost < BATCH);
        await this.device.done();
        const milliseconds = performance.now() - start, each = milliseconds / pixels;
        variant.cost = variant.cost ? 0.7 * variant.cost + 0.3 * each : each;
        return milliseconds;
    }

    // A rectangle of the sample into the tile's target, at [column, row] of it.
    draw({program, names, weights}, values, [x, y], [width, height], [column, row] = [0, 0]) {
        const {gl} = this.device;
        gl.useProgram(program);
        gl.bindTexture(gl.TEXTURE_2D, weights);
        for (const [name, value] of Object.entries({...values, origin: [x - column, y - row]})) {
            const at = names[name];
            if (!at) continue;
            if (name === "camera") gl.uniformMatrix4fv(at, false, value);
            else if (name === "iterations") gl.uniform1iv(at, value);
            else if (typeof value === "number") gl.uniform1i(at, value);
            else if (name === "delta" || value.length === 1) gl.uniform1fv(at, value);
            else gl[`uniform${value.length}fv`](at, value);
        }
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.tile.framebuffer);
        gl.viewport(column, row, width, height);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    // What `draw` drew, into the picture's mean.
    add(picture, [x, y], [width, height], share) {
        const {gl} = this.device, {program, names} = this.accumulate;
        gl.useProgram(program);
        gl.bindFramebuffer(gl.FRAMEBUFFER, picture.framebuffer);
        gl.viewport(x, y, width, height);
        gl.uniform2i(names.corner, x, y);
        gl.bindTexture(gl.TEXTURE_2D, this.tile.texture);
        if (share < 1) {
            gl.enable(gl.BLEND);
            gl.blendColor(0, 0, 0, share);
            gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
        }
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        gl.disable(gl.BLEND);
    }

    // A picture onto the canvas, or, linear light, onto another picture.
    put(picture, onto = null) {
        const {gl} = this.device, {program, names} = this.present, {width, height} = onto ?? this.canvas;
        gl.useProgram(program);
        gl.bindTexture(gl.TEXTURE_2D, picture.texture);
        gl.bindFramebuffer(gl.FRAMEBUFFER, onto && onto.framebuffer);
        gl.viewport(0, 0, width, height);
        gl.uniform2f(names.size, width, height);
        gl.uniform1i(names.encoded, onto ? 0 : 1);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    // Red of the first `count` pixels of the tile's target.
    reds(count) {
        const {gl} = this.device, found = new Float32Array(4 * count);
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.tile.framebuffer);
        gl.readPixels(0, 0, count, 1, gl.RGBA, gl.FLOAT, found);
        return found.filter((_, i) => i % 4 === 0);
    }
}
