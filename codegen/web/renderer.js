import {FOCAL, matrix} from "./camera.js";
import {ContextLost, Device, nextFrame, pause} from "./device.js";
import {TEXTURE_WIDTH} from "./texture.js";

// Draws a model's shader in tiles, a few milliseconds of them at a time, so that the page never freezes: coarse pixels
// while something moves, then all of them, then more samples of each. Draws only when something changed.
const TILE = 512;
const BATCH = 20; // milliseconds of drawing that are asked for at once
const SMOOTH = 33; // milliseconds that a frame may take while something moves
const COARSEST = 1 / 16;
const REST = 160; // milliseconds without a change after which the picture is refined
const SAMPLES = 16;
const PATIENCE = 15000; // milliseconds of refining after which no further sample is begun
const LITERAL_LIMIT = 60000; // milliseconds that compiling the literals may take
const LOOP_LIMIT = 65535; // iterations after which Mesa's llvmpipe stops a fragment, silently

const SHADINGS = ["phong", "normal", "depth", "steps", "texture", "data"];

// Offset k of the samples of a pixel, in pixels: the first is its centre, the others a low-discrepancy sequence.
function jitter(k) {
    return k ? [(0.5 + k * 0.7548776662) % 1 - 0.5, (0.5 + k * 0.5698402910) % 1 - 0.5] : [0, 0];
}

export class Renderer {
    // listener: {frame(facts), stored(storage, error), failed(error)}
    constructor(canvas, sources, defaults, listener) {
        Object.assign(this, {canvas, sources, defaults, listener});
        this.version = 0;
        this.generation = 0;
        this.scale = 1 / 8;
        this.patience = PATIENCE;
        this.open();
    }

    // Makes everything that a context holds; after a lost one, again.
    open() {
        this.device = new Device(this.canvas);
        this.software = /llvmpipe/i.test(this.device.name);
        const open = (source) => this.device.finish(this.device.begin(`#version 300 es\nprecision highp float;\n${source}`));
        this.accumulate = open(this.sources.accumulate);
        this.present = open(this.sources.present);
        const gl = this.device.gl;
        this.tile = this.device.target(this.device.sampleFormat, TILE, TILE, gl.NEAREST);
        this.still = this.quick = this.current = null;
    }

    // Shows a model; resolves when its texture variant is there. literal: the other variant's field, or null.
    // probes: {points, values} of the field. memory: what earlier visits found,
    // {read(), write(storage)}. A later call, or a lost context, supersedes this one.
    async load(model, field, literal, probes, memory) {
        const generation = ++this.generation, {device} = this;
        device.check(field.height, model.levels.length);
        const start = performance.now(), begun = device.begin(this.text(field.text, model));
        while (!device.isReady(begun)) await pause(15);
        const variant = {storage: "texture", ...this.stored(field), ...device.finish(begun)};
        await this.exclusively(async () => {
            if (generation !== this.generation) return;
            this.drop(this.current);
            Object.assign(this, {model, probes, current: variant, cost: 0, fresh: true});
            await this.warm(variant, start);
            this.listener.stored(variant.storage, await this.error(variant));
            this.change(true);
        });
        if (generation === this.generation && literal && device.patient && !["texture", "trying"].includes(memory.read()))
            this.race(literal, generation, memory).catch((error) => this.lostOr(error));
    }

    // A field's weights and loops, as a variant keeps them.
    stored({height, texels, loops}) {
        const {gl} = this.device;
        return {loops, weights: height ? this.device.texture(gl.RGBA32F, TEXTURE_WIDTH, height, gl.NEAREST, texels) : null};
    }

    drop(variant) {
        this.device.gl.deleteProgram(variant?.program ?? null);
        this.device.gl.deleteTexture(variant?.weights ?? null);
    }

    text(field, model) {
        const prologue = this.sources.prologue.replace(/const int LEVELS = \d+;/, `const int LEVELS = ${model.levels.length};`);
        return `${prologue}\n${field}\n${this.sources.main}`;
    }

    // Compiles the literals beside the drawing, times both variants on what is seen, and keeps the faster.
    async race(literal, generation, memory) {
        const {device} = this, remembered = memory.read();
        memory.write("trying");
        const start = performance.now(), begun = device.begin(this.text(literal.text, this.model));
        while (!device.isReady(begun)) {
            await pause(50);
            if (generation !== this.generation || device.lost) return;
            if (performance.now() - start > LITERAL_LIMIT) {
                device.gl.deleteProgram(begun.program);
                return memory.write("texture");
            }
        }
        let variant;
        try {
            variant = {storage: "literal", ...this.stored(literal), ...device.finish(begun)};
        } catch {
            return memory.write("texture");
        }
        await this.exclusively(async () => {
            if (generation !== this.generation) return;
            await this.warm(variant, start);
            const faster = remembered === "literal" || await this.seconds(variant) < await this.seconds(this.current);
            const [kept, other] = faster ? [variant, this.current] : [this.current, variant];
            this.drop(other);
            memory.write(kept.storage);
            if (!faster) return;
            Object.assign(this, {current: kept, cost: 0});
            this.listener.stored(kept.storage, await this.error(kept));
        });
    }

    // What is to be seen from now on. moving: coarse pixels will do until it rests.
    show(camera, options, moving) {
        Object.assign(this, {camera, options});
        this.change(moving);
    }

    change(moving) {
        ++this.version;
        this.restAt = performance.now() + (moving ? REST : 0);
        this.wake();
    }

    get settled() {
        return !this.busy && this.drawn === this.version;
    }

    // Runs `work` between two batches of drawing.
    exclusively(work) {
        const before = this.queue ?? Promise.resolve();
        const turn = before.then(work);
        this.queue = turn.catch(() => {});
        return turn;
    }

    wake() {
        if (this.busy) return;
        this.busy = true;
        this.work().catch((error) => this.lostOr(error));
    }

    lostOr(error) {
        if (!(error instanceof ContextLost) && !this.device.lost) this.listener.failed(error);
    }

    async work() {
        try {
            while (this.current && this.camera && !this.device.lost && this.drawn !== this.version) {
                if (this.quicked !== this.version) {
                    await nextFrame();
                    await this.exclusively(() => this.drawQuick());
                } else if (performance.now() < this.restAt) {
                    await pause(20);
                } else {
                    await this.exclusively(() => this.refine());
                }
            }
        } finally {
            this.busy = false;
        }
    }

    get size() {
        const factor = this.options.resolution === "auto" ? 1 : this.options.resolution;
        return [this.canvas.width, this.canvas.height].map((side) => Math.max(1, Math.round(side * factor)));
    }

    // A whole frame at the scale that the last ones' times suggest.
    async drawQuick() {
        const version = this.version, full = this.size;
        const scale = this.options.resolution === "auto" ? this.scale : 1;
        const size = full.map((side) => Math.max(1, Math.round(side * scale)));
        const whole = scale === 1;
        if (whole && this.quick) this.device.release(this.quick);
        if (whole) this.still = this.sized(this.still, size);
        this.quick = whole ? null : this.sized(this.quick, size);
        const picture = this.quick ?? this.still;
        const pass = this.fresh ? this.pass(size, 0, 1, 1) : this.pass(size, 0);
        let spent = 0;
        while (pass.next < pass.tiles.length) spent += await this.batch(pass, picture, 1);
        this.put(picture);
        this.quicked = version;
        this.refining = {sample: whole && !this.fresh ? 1 : 0, pass: null, began: performance.now(), spent: 0};
        this.listener.frame({milliseconds: spent, size, samples: 1, settled: false});
        if (spent > 1.3 * SMOOTH) this.scale = Math.max(COARSEST, this.scale * Math.max(0.35, Math.sqrt(SMOOTH / spent)));
        else if (spent < 0.5 * SMOOTH) this.scale = Math.min(1, this.scale * Math.min(2, Math.sqrt(SMOOTH / Math.max(spent, 1))));
        this.fresh = false;
    }

    // The next few tiles of the next sample of the picture at rest.
    async refine() {
        const {refining, version, size} = this;
        if (this.quicked !== version) return;
        if (!refining.pass) {
            if (this.quick && refining.sample === 0) {
                this.still = this.sized(this.still, size);
                this.put(this.quick, this.still);
            }
            refining.pass = this.pass(size, refining.sample);
            refining.spent = 0;
        }
        const {pass, sample} = refining;
        refining.spent += await this.batch(pass, this.still, 1 / (sample + 1));
        if (version !== this.version) return;
        const complete = pass.next === pass.tiles.length, now = performance.now();
        if (complete || now - (this.shown ?? 0) > 120) {
            this.put(this.still);
            this.shown = now;
        }
        if (!complete) return;
        refining.pass = null;
        ++refining.sample;
        if (refining.sample >= this.samples || now - refining.began > this.patience) this.drawn = version;
        this.listener.frame({milliseconds: refining.spent, size, samples: refining.sample, settled: this.drawn === version});
    }

    get samples() {
        return this.device.half ? SAMPLES : 4;
    }

    sized(picture, [width, height]) {
        if (picture && picture.width === width && picture.height === height) return picture;
        if (picture) this.device.release(picture);
        return this.device.target(this.device.pictureFormat, width, height, this.device.gl.LINEAR);
    }

    // Tiles of a picture of `size`, from the middle out, and what their draws have in common.
    pass(size, sample, level = this.options.level, normalLevel = this.options.normalLevel ?? level) {
        const [width, height] = size, pixels = this.cost ? BATCH / this.cost : 4096;
        const side = Math.min(TILE, Math.max(32, 2 ** Math.floor(Math.log2(Math.sqrt(pixels)))));
        const tiles = [];
        for (let y = 0; y < height; y += side)
            for (let x = 0; x < width; x += side) tiles.push([x, y, Math.min(side, width - x), Math.min(side, height - y)]);
        const far = ([x, y]) => Math.hypot(x + side / 2 - width / 2, y + side / 2 - height / 2);
        tiles.sort((a, b) => far(a) - far(b));
        const {camera, options, model} = this, levels = model.levels.length;
        const traced = Math.min(level, levels), normal = Math.min(normalLevel, levels);
        const wanted = model.levels.map((each) => Math.max(1, Math.round(each.iterations * options.iterations)));
        const schedule = this.fitting(traced, normal, wanted, this.defaults.rounds[0]);
        return {tiles, next: 0, values: {
            resolution: size, jitter: jitter(sample), camera: matrix(camera, width / height), focal: [FOCAL],
            level: traced, normal_level: normal, iterations: schedule.steps,
            rounds: schedule.rounds, delta: model.levels.map((each) => each.delta), step_scale: this.defaults.step_scale,
            shading: SHADINGS.indexOf(options.shading), light: options.light, background_bottom: options.background[0],
            background_top: options.background[1], time: [options.time ?? 0],
        }};
    }

    // Steps and rounds, at most those wanted, that llvmpipe draws whole (as viewer/options.py does).
    fitting(level, normal, steps, rounds) {
        const {loops} = this.current;
        if (!this.software || !loops) return {steps, rounds};
        const worst = () => rounds * (2 + steps.slice(0, level).reduce(
            (sum, count, i) => sum + 2 + count * (1 + loops.value[i]), 0)) + 1 + loops.gradient[normal - 1] + loops.texture;
        if (worst() > LOOP_LIMIT) steps = steps.map((count, i) => (i === level - 1 ? Math.min(count, 3) : count));
        while (rounds > 1 && worst() > LOOP_LIMIT) --rounds;
        return {steps, rounds};
    }

    // Draws tiles of a pass into the picture's mean until a batch's time is likely used up; milliseconds it took.
    async batch(pass, picture, share) {
        const {gl} = this.device, start = performance.now();
        let pixels = 0;
        do {
            const [x, y, width, height] = pass.tiles[pass.next++];
            this.draw(this.current, pass.values, [x, y], [width, height]);
            gl.useProgram(this.accumulate.program);
            gl.bindFramebuffer(gl.FRAMEBUFFER, picture.framebuffer);
            gl.viewport(x, y, width, height);
            gl.uniform2i(this.accumulate.names.corner, x, y);
            gl.bindTexture(gl.TEXTURE_2D, this.tile.texture);
            if (share < 1) {
                gl.enable(gl.BLEND);
                gl.blendColor(0, 0, 0, share);
                gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
            }
            gl.drawArrays(gl.TRIANGLES, 0, 3);
            gl.disable(gl.BLEND);
            pixels += width * height;
        } while (pass.next < pass.tiles.length && this.cost && pixels * this.cost < BATCH);
        await this.device.done();
        const milliseconds = performance.now() - start, each = milliseconds / pixels;
        this.cost = this.cost ? 0.7 * this.cost + 0.3 * each : each;
        return milliseconds;
    }

    // One tile by the model's shader, into the corner of the tile's target.
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

    // A picture onto the canvas, or, linear light, onto another picture.
    put(picture, onto = null) {
        const {gl} = this.device, [width, height] = onto ? [onto.width, onto.height] : [this.canvas.width, this.canvas.height];
        gl.useProgram(this.present.program);
        gl.bindTexture(gl.TEXTURE_2D, picture.texture);
        gl.bindFramebuffer(gl.FRAMEBUFFER, onto ? onto.framebuffer : null);
        gl.viewport(0, 0, width, height);
        gl.uniform2f(this.present.names.size, width, height);
        gl.uniform1i(this.present.names.encoded, onto ? 0 : 1);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    // A first draw of one pixel, where drivers do most of their compiling; notes the time since `start`.
    async warm(variant, start) {
        const {values} = this.pass([1, 1], 0, 1, 1);
        this.draw(variant, values, [0, 0], [1, 1]);
        await this.device.done();
        performance.measure(`${variant.storage}: compiled and first drawn`, {start});
    }

    // Milliseconds of a draw of the middle of the picture.
    async seconds(variant) {
        const {values} = this.pass([256, 256], 0);
        for (let count = 1; ; count *= 4) {
            const start = performance.now();
            for (let k = 0; k < count; ++k) this.draw(variant, values, [96, 96], [64, 64]);
            await this.device.done();
            const milliseconds = performance.now() - start;
            if (milliseconds > 60 || count > 100) return milliseconds / count;
        }
    }

    // Largest difference of the shader's field to the probes' values; null where the device cannot say.
    // A ray that begins at a point and makes one step of scale 1 ends at t = f.
    async error(variant) {
        const {points, values: expected} = this.probes, {gl} = this.device;
        if (!this.device.float || !expected.length) return null;
        const levels = this.model.levels.length;
        const {values} = this.pass([1, 1], 0, levels, levels);
        Object.assign(values, {rounds: 1, iterations: this.model.levels.map(() => 1),
            step_scale: [1], shading: SHADINGS.indexOf("data")});
        expected.forEach((_, k) => {
            const eye = points.slice(3 * k, 3 * k + 3);
            values.camera = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, ...eye, 1];
            this.draw(variant, values, [0, 0], [1, 1], [k, 0]);
        });
        await this.device.done();
        const found = new Float32Array(4 * expected.length);
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.tile.framebuffer);
        gl.readPixels(0, 0, expected.length, 1, gl.RGBA, gl.FLOAT, found);
        return Math.max(...expected.map((value, k) => Math.abs(found[4 * k] - value)));
    }

    // The canvas has another size, and is blank: shows what there is until it is drawn anew.
    resized() {
        const picture = this.quick ?? this.still;
        if (picture) this.put(picture);
    }

    // The refined picture as a PNG. Who saves it waits longer for its samples.
    async png() {
        this.patience = 10 * PATIENCE;
        if (this.settled && this.refining.sample < this.samples) {
            this.refining.began = performance.now();
            this.drawn = -1;
            this.wake();
        }
        while (!this.settled && !this.device.lost) await pause(30);
        this.patience = PATIENCE;
        this.put(this.still);
        return new Promise((resolve) => this.canvas.toBlob(resolve, "image/png"));
    }
}
