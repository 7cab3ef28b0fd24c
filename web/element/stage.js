import {homeOf, matrix, orbited, panned, zoomed} from "../draw/camera.js";
import {nextFrame} from "../draw/device.js";
import {Renderer} from "../draw/renderer.js";
import {facts, shared} from "../model/facts.js";
import {printField} from "../print/field.js";
import {probes} from "../print/reference.js";
import {listenToKeys, listenToPointers} from "../view/gestures.js";

/** @import {Move} from "../view/gestures.js" */
const SIDEWAYS = 8; // pixels; a browser scrolls after some 15

// Draws one model on one canvas: its camera, its options and its motion. view.js is the same for a whole page.
// camera: see camera.js, or null for the model's front.
export class Stage {
    /** @type {Camera | null} */ camera = null;
    /** @type {ShownModel | null} */ model = null;
    isLoaded = false;
    isFreed = false;
    /** @type {object | 0} */ turning = 0;
    /** @type {object | null} */ playing = null;
    phase = 0;
    /** @type {Options} */ options = {
        level: Infinity,
        normalLevel: null,
        shading: facts.shade,
        iterations: 1,
        resolution: "auto",
        time: 0,
        light: shared.defaults.light.map((c) => c / Math.hypot(...shared.defaults.light)),
        background: [],
    };

    /** @param {HTMLCanvasElement} canvas
     * @param {Pick<Listener, "loaded" | "frame" | "failed"> & {moved: (isByVisitor: boolean) => void, lost: () => void}} listener
     * loaded: called once, when the model's shader is ready; lost: the canvas is blank until the browser restores its context,
     * which it does where lost() does not free the stage */
    constructor(canvas, listener) {
        const none = () => {};
        this.canvas = canvas;
        this.listener = listener;
        this.renderer = new Renderer(canvas, (name) => facts.shaders[name], {
            frame: (frame) => this.isFreed || listener.frame(frame),
            progress: none,
            stored: none,
            trying: none,
            failed: (error) => this.isFreed || listener.failed(error),
        });
        canvas.addEventListener("webglcontextlost", (event) => {
            if (!this.isFreed) listener.lost();
            if (!this.isFreed) event.preventDefault(); // for the browser to restore it
        });
        canvas.addEventListener("webglcontextrestored", () => this.isFreed || this.restore());
    }

    /** Resolves when the model's shader is ready, or the context is lost. @param {ShownModel} model */
    async show(model) {
        this.model = model;
        this.resize();
        this.draw(true);
        const field = printField(model, "texture", this.renderer.device.unroll);
        await this.renderer.load(model, field, null, model.field ? {points: [], values: []} : probes(model), null);
        if (this.isFreed || this.isLoaded || !this.renderer.variants.current) return;
        this.isLoaded = true;
        this.listener.loaded();
    }

    async restore() {
        try {
            this.renderer.open();
            if (this.model) await this.show(this.model);
        } catch (error) {
            if (!this.isFreed) this.listener.failed(/** @type {Error} */ (error));
        }
    }

    get home() {
        return homeOf(this.model?.front ?? null);
    }

    get view() {
        return this.camera ?? this.home;
    }

    get aspect() {
        return this.canvas.width / this.canvas.height;
    }

    // Distance from the eye to the target, model units.
    get distance() {
        const eye = matrix(this.view, this.aspect).slice(12, 15);
        return Math.hypot(...eye.map((c, i) => c - this.view.target[i]));
    }

    /** @param {boolean} moving */
    draw(moving) {
        const levels = this.model?.levels.length ?? 1, {options} = this;
        const isKnown = options.shading === "texture" ? this.model?.texture : shared.shadings.includes(options.shading);
        const shading = isKnown ? options.shading : facts.shade;
        this.renderer.show(this.view, {...options, shading, level: Math.min(options.level, levels)}, moving);
    }

    /** @param {Partial<Options>} change */
    set(change, moving = false) {
        Object.assign(this.options, change);
        this.draw(moving);
    }

    /** @param {Camera | null} camera */
    move(camera, isByVisitor = true) {
        if (isByVisitor) this.turning = 0;
        this.camera = camera;
        this.draw(true);
        this.listener.moved(isByVisitor);
    }

    /** @param {number} right @param {number} up */
    turn(right, up) {
        this.move(orbited(this.view, -180 * right, -180 * up));
    }

    /** @param {number} right @param {number} up */
    pan(right, up) {
        this.move(panned(this.view, -right, -up, this.aspect));
    }

    /** @param {number} factor */
    zoom(factor) {
        this.move(zoomed(this.view, factor, this.aspect));
    }

    reset() {
        this.move(null);
    }

    /** Lets the visitor move the camera. zooms, pans: whether also these. isGreedy: whether they never scroll the
     * page: else, the wheel does without focus and without Ctrl, and so does a finger up and down.
     * @param {boolean} zooms @param {boolean} pans @param {boolean} isGreedy */
    listen(zooms, pans, isGreedy) {
        /** @type {Move | null} */ const pan = pans ? (right, up) => this.pan(right, up) : null,
            zoom = zooms ? (/** @type {number} */ factor) => this.zoom(factor) : null;
        listenToPointers(this.canvas, {
            turn: (right, up) => this.turn(right, up),
            pan,
            zoom,
            reset: () => this.reset(),
            sideways: isGreedy ? 0 : SIDEWAYS,
            takesWheel: ({ctrlKey, metaKey}) => isGreedy || ctrlKey || metaKey || this.canvas.matches(":focus"),
        });
        // Where one finger scrolls the page, two do not.
        this.canvas.addEventListener("touchmove", (event) => {
            if (event.targetTouches.length > 1 && (pan || zoom)) event.preventDefault();
        }, {passive: false});
        /** @type {(right: number, up: number) => (event: KeyboardEvent) => void} */
        const arrow = (right, up) => ({shiftKey}) => (
            shiftKey ? pan?.(-0.05 * right, -0.05 * up) : this.turn(-right / 36, -up / 36)
        );
        listenToKeys({
            ArrowLeft: arrow(-1, 0),
            ArrowRight: arrow(1, 0),
            ArrowUp: arrow(0, 1),
            ArrowDown: arrow(0, -1),
            r: () => this.reset(),
            Home: () => this.reset(),
            ...(zoom && {"+": () => zoom(0.9), "=": () => zoom(0.9), "-": () => zoom(1 / 0.9)}),
        }, this.canvas);
    }

    /** Turns the shape until the visitor moves it. seconds: of a turn, negative the other way around; 0 stops.
     * @param {number} seconds */
    async turntable(seconds) {
        const token = this.turning = seconds ? {} : 0;
        for await (const passed of this.frames(() => token && this.turning === token))
            if (this.renderer.seen) this.move(orbited(this.view, 360 * passed / seconds, 0), false);
    }

    // Plays a moving model back and forth.
    async play() {
        if (this.playing) return;
        const token = this.playing = {};
        for await (const passed of this.frames(() => this.playing === token)) {
            this.phase = (this.phase + passed / shared.period) % 1;
            this.set({time: 0.5 - 0.5 * Math.cos(2 * Math.PI * this.phase)}, true);
        }
    }

    pause() {
        this.playing = null;
    }

    /** Yields the seconds between frames while a condition holds, but none while a picture is saved.
     * @param {() => unknown} holds */
    async *frames(holds) {
        for (let last = performance.now();;) {
            await nextFrame();
            if (this.isFreed || !holds()) return;
            const now = performance.now();
            if (!this.renderer.saving) yield Math.min(now - last, 250) / 1000;
            last = now;
        }
    }

    // Fits the pixels to the canvas's size; a hidden canvas keeps them.
    resize() {
        const {canvas} = this, {clientWidth, clientHeight} = canvas;
        if (!clientWidth || !clientHeight) return;
        const scale = Math.min(devicePixelRatio || 1, 8192 / Math.max(clientWidth, clientHeight));
        const [width, height] = [clientWidth, clientHeight].map((side) => Math.max(1, Math.round(side * scale)));
        if (width === canvas.width && height === canvas.height) return;
        Object.assign(canvas, {width, height});
        this.renderer.resized();
        this.draw(true);
    }

    // Returns the last picture as a 2D canvas.
    picture() {
        const copy = document.createElement("canvas"), {width, height} = this.canvas;
        Object.assign(copy, {width, height});
        this.renderer.resized();
        copy.getContext("2d")?.drawImage(this.canvas, 0, 0);
        return copy;
    }

    // Gives the graphics context back. Nothing else is called afterwards.
    free() {
        this.isFreed = true;
        const {device} = this.renderer;
        if (!device.lost) device.gl.getExtension("WEBGL_lose_context")?.loseContext();
    }
}
