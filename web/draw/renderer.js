import {pause} from "../model/pause.js";
import {DeviceError, nextFrame} from "./device.js";
import {Painter} from "./painter.js";
import {COARSEST, Following} from "./reprojection.js";
import {jitter, uniforms, withOptions} from "./uniforms.js";
import {Variants} from "./variants.js";

// Schedules the drawing in slices of some milliseconds, so that the page never freezes: coarse pixels during motion, or
// where those take too long, the last picture (reprojection.js); then all pixels, then further samples where
// they matter. It draws only after changes.
/** @import {Pass} from "./painter.js"
 * @import {wanted} from "./samples.js"
 * @import {Memory} from "./variants.js"
 * @typedef {{samples: number, pass: Pass | null, tiles: number, wanted: ReturnType<typeof wanted> | null, began: number,
 * spent: number, frame: number}} Refining Complete samples of the picture, the pass of the next one and the number of its
 * tiles; milliseconds: when it began, of drawing the sample, and of drawing a frame */
const SMOOTH = 33, LIVE = 300; // milliseconds of a frame: during motion, and of a training
const REST = 160; // milliseconds without a change before refinement
const SAMPLES = 16; // largest number of samples per pixel
const PATIENCE = 15000; // milliseconds of refinement before the last sample

export class Renderer {
    /** @type {Refining} */ refining;
    /** @type {Target | null} */ still = null;
    /** @type {Target | null} */ quick = null;
    version = 0;
    quicked = -1; // version of the coarse picture
    saving = 0;
    /** @type {number} */ restAt;
    patience = PATIENCE;
    motion = {goal: SMOOTH, scale: COARSEST}; // milliseconds of a coarse frame, and the resolution for it
    live = {goal: LIVE, scale: 1 / 8};
    pace = this.motion;
    scene = /** @type {Scene} */ ({});
    following = new Following(this);

    /** @param {HTMLCanvasElement} canvas @param {(name: string) => string} source text of a GLSL file in the page
     * @param {Omit<Listener, "loaded">} listener */
    constructor(canvas, source, listener) {
        const loaded = () => {
            this.fresh = true;
            this.change(true);
        };
        this.canvas = canvas;
        this.listener = listener;
        this.painter = new Painter(canvas, source);
        this.variants = new Variants(this.painter, this.scene, {...listener, loaded, settled: () => this.settled});
    }

    get device() {
        return this.painter.device;
    }

    // The variant of a picture.
    get current() {
        return /** @type {Variant} */ (this.variants.current);
    }

    // Restarts after a lost context; call load() next.
    open() {
        this.painter.open();
        this.still = this.quick = this.variants.current = null;
        this.following = new Following(this);
    }

    /** See Variants.load; ignores a lost context.
     * @param {ShownModel} model @param {PrintedField} field @param {PrintedField | null} literal
     * @param {Probes} probes @param {Memory | null} memory */
    load(model, field, literal, probes, memory) {
        return this.device.unlessLost(this.variants.load(model, field, literal, probes, memory));
    }

    /** Draws the current model with other weights, once, and coarsely; until the next change, nothing is refined.
     * model: of the same layers; texels: of its printField.
     * @param {ShownModel} model @param {Float32Array} texels */
    replace(model, texels) {
        return this.device.unlessLost(this.painter.exclusively(() => {
            if (!this.variants.current) return; // the context has just come back
            this.variants.replace(model, texels);
            this.change(true);
            this.restAt = Infinity;
            this.pace = this.live;
        }));
    }

    /** Sets camera and options. moving: coarse pixels suffice for now.
     * @param {Camera} camera @param {Options} options @param {boolean} moving */
    show(camera, options, moving) {
        Object.assign(this.scene, {camera, options});
        this.pace = this.motion;
        this.change(moving);
    }

    /** @param {boolean} moving */
    change(moving) {
        ++this.version;
        this.restAt = performance.now() + (moving ? REST : 0);
        this.wake();
    }

    get settled() {
        return !this.busy && this.drawn === this.version;
    }

    // Whether the coarse picture of the last change is drawn.
    get seen() {
        return this.quicked === this.version;
    }

    wake() {
        if (this.busy) return;
        this.busy = true;
        this.device.unlessLost(this.work()).catch(this.listener.failed);
    }

    async work() {
        try {
            while (this.variants.current && this.scene.camera && !this.device.lost && this.drawn !== this.version) {
                if (this.quicked !== this.version) {
                    await nextFrame();
                    await this.painter.exclusively(() => this.drawMoving());
                } else if (performance.now() < this.restAt) {
                    await pause(20);
                } else {
                    await this.painter.exclusively(() => this.refine());
                }
            }
        } finally {
            this.busy = false;
        }
    }

    get size() {
        const {resolution} = this.scene.options, factor = resolution === "auto" ? 1 : resolution;
        return [this.canvas.width, this.canvas.height].map((side) => Math.max(1, Math.round(side * factor)));
    }

    get samples() {
        return this.device.half ? SAMPLES : 4;
    }

    // Whether the number of samples depends on contrast.
    get adapts() {
        return this.device.half;
    }

    /** Returns the pass (painter.js) of one sample of every pixel of a picture of `size`.
     * @param {Scene} scene @param {number[]} size @param {number} sample @returns {Pass} */
    pass(scene, size, sample) {
        const {loops, cost} = this.current;
        return {tiles: this.painter.tiles(size, cost), values: uniforms(scene, loops, size, sample)};
    }

    /** Returns the pass of one further sample of all pixels, or of the pixels that need it.
     * @param {number[]} size @param {number} sample @returns {Pass} */
    further(size, sample) {
        const {refining: {wanted}, still} = this, all = this.pass(this.scene, size, sample);
        if (!wanted || !sample) return all;
        const pixels = wanted.pixels.filter((_, i) => wanted.counts[i] >= sample);
        return {
            ...all,
            tiles: this.painter.packs(pixels, /** @type {Target} */ (still), jitter(sample), this.current.cost),
        };
    }

    /** Draws one sample of every pixel of the canvas, and resolves in the task that drew the last one.
     * @param {Camera} camera */
    frame(camera) {
        const {painter, canvas: {width, height}} = this;
        return painter.exclusively(async () => {
            const pass = this.pass({...this.scene, camera}, [width, height], 0);
            this.following.spoil();
            const still = this.still = painter.sized(this.still, [width, height]);
            while (pass.tiles.length) await painter.batch(this.current, pass, still, 1);
            painter.put(still);
        });
    }

    drawMoving() {
        if (!this.variants.current) return;
        return this.following.isBetter ? this.following.step() : this.drawQuick();
    }

    /** Returns the picture "still" or "quick" in a size. A new one begins as the last one: a canvas that is resized
     * meanwhile would show black tiles.
     * @param {"still" | "quick"} name @param {number[]} size */
    begun(name, size) {
        const {painter, [name]: own} = this, last = this.quick ?? this.still;
        if (own?.width === size[0] && own.height === size[1]) return own;
        const picture = this[name] = painter.sized(null, size);
        if (last) painter.put(last, picture);
        if (own) this.device.release(own);
        return picture;
    }

    // Draws a frame at a resolution that fits the last frames' times. A model's first frame shows level 1.
    async drawQuick() {
        this.following.spoil();
        const {painter, version, fresh, pace} = this, scene = {...this.scene};
        const scale = scene.options.resolution === "auto" ? pace.scale : 1;
        const size = this.size.map((side) => Math.max(1, Math.round(side * scale))), whole = scale === 1;
        const picture = this.begun(whole ? "still" : "quick", size);
        if (whole && this.quick) this.device.release(this.quick);
        if (whole) this.quick = null;
        const pass = this.pass(fresh ? withOptions(scene, {level: 1, normalLevel: 1}) : scene, size, 0);
        let spent = 0;
        while (pass.tiles.length) spent += await painter.batch(this.current, pass, picture, 1);
        painter.put(picture);
        this.quicked = version;
        if (pace === this.live) this.current.proven = true; // a training draws nothing finer
        this.rest(whole && !fresh ? 1 : 0, spent);
        this.following.keep(whole ? "still" : "quick", scene, scale);
        this.listener.frame({milliseconds: spent, size, samples: 1, settled: false});
        const factor = Math.sqrt(pace.goal / Math.max(spent, 1));
        if (spent > 1.3 * pace.goal) pace.scale = Math.max(COARSEST, pace.scale * Math.max(0.35, factor));
        else if (spent < 0.5 * pace.goal) pace.scale = Math.min(1, pace.scale * Math.min(2, factor));
        this.fresh = false;
    }

    /** Begins the refinement. samples: complete ones of the picture; spent: milliseconds of drawing it.
     * @param {number} samples @param {number} spent */
    rest(samples, spent) {
        this.refining = {samples, pass: null, tiles: 0, wanted: null, began: performance.now(), spent: 0, frame: spent};
    }

    // Draws the next tiles of the refined picture.
    async refine() {
        const {painter, refining, version, size} = this;
        if (this.quicked !== version) return;
        if (!refining.pass) {
            if (this.quick && refining.samples === 0) {
                this.still = painter.sized(this.still, size);
                this.following.keep("still", {...this.scene}, 0); // a coarse picture with finer tiles
                painter.put(this.quick, this.still);
            }
            const still = /** @type {Target} */ (this.still);
            if (refining.samples === 1 && this.adapts) refining.wanted = await painter.wanted(still, this.samples);
            refining.pass = this.further(size, refining.samples);
            refining.tiles = refining.pass.tiles.length;
            refining.spent = 0;
        }
        const share = 1 / (refining.samples + 1), still = /** @type {Target} */ (this.still);
        if (refining.tiles) refining.spent += await painter.batch(this.current, refining.pass, still, share);
        if (version !== this.version) return;
        const complete = !refining.pass.tiles.length, now = performance.now();
        if (complete || now - (this.presentedAt ?? 0) > 120) {
            painter.put(still);
            this.presentedAt = now;
        }
        if (!complete) {
            if (refining.samples === 0) this.listener.progress(size, 1 - refining.pass.tiles.length / refining.tiles);
            return;
        }
        refining.pass = null;
        if (refining.samples === 0) {
            refining.frame = refining.spent;
            this.following.keep("still", {...this.scene}, 1);
        }
        refining.samples = refining.tiles ? refining.samples + 1 : this.samples;
        this.current.proven = true;
        if (refining.samples >= this.samples || now - refining.began > this.patience) this.drawn = version;
        const settled = this.drawn === version;
        this.listener.frame({milliseconds: refining.frame, size, samples: refining.samples, settled});
    }

    // Draws the last picture to a resized, hence blank, canvas.
    resized() {
        const picture = this.quick ?? this.still;
        if (this.following.shown && !this.seen) this.following.put();
        else if (picture) this.painter.put(picture);
    }

    /** Resolves to the refined picture as a PNG, with more time for its samples. Motion waits while `saving` is above
     * 0. Throws DeviceError where the context is lost.
     * @returns {Promise<Blob>} */
    async png() {
        const {device} = this; // after a lost context, there is another one
        ++this.saving;
        this.patience = 10 * PATIENCE;
        if (this.settled && this.refining.samples < this.samples) {
            this.refining.began = performance.now();
            this.drawn = -1;
            this.wake();
        }
        while (!this.settled && !device.lost) await pause(30);
        this.patience = PATIENCE;
        --this.saving;
        if (device.lost) throw new DeviceError("There is no picture to save: its graphics context is lost.");
        this.painter.put(/** @type {Target} */ (this.still));
        return new Promise((resolve) => this.canvas.toBlob(/** @type {BlobCallback} */ (resolve), "image/png"));
    }
}
