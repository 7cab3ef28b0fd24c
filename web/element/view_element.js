import {facts} from "../model/facts.js";
import {askToDraw, endDrawing, giveTurns} from "./contexts.js";
import {ElementTree} from "./element_tree.js";
import {findModel, Models} from "./models.js";
import {isMotionWelcome, readOrbit, readTurn, writtenOrbit} from "./orbits.js";
import {addProperties, adoptProperties, ATTRIBUTES} from "./properties.js";
import {Stage} from "./stage.js";

// <mplicits-view>: a model in a page. Attributes and events are those of Google's <model-viewer> where they mean the
// same; docs/engines.md lists them. A graphics context exists only while the element is in view, and is not resting (contexts.js).
const NEAR_VIEW = "200px"; // distance from the window at which an element begins
const AWAY = 1000; // milliseconds out of view after which an element frees its context
const STEADY = 10000; // milliseconds of drawing after which a context counts as good, also where the shape always moves
const CONTROLS = ["camera-controls", "disable-zoom", "disable-pan", "touch-action", "alt"];
const TURNS = ["turntable", "auto-rotate", "rotation-per-second"];
const RESET = "The graphics driver was reset. The model comes back when the driver does.";
const LOST = "The graphics driver fails at this model. Reload the page to try again.";

/** @import {Properties} from "./properties.js" */
export class MplicitsView extends /** @type {new () => HTMLElement & Properties} */ (globalThis.HTMLElement ?? Object) { // on a server, nothing makes one
    static observedAttributes = Object.keys(ATTRIBUTES);
    static models = new Models();
    #connected = false; // unlike isConnected, not yet while the browser tells of the attributes of a new element
    #near = false;
    /** @type {AbortController | null} */
    #load = null; // AbortController of the current model; null before, and after a failure
    #failed = false;
    #losses = 0; // of the graphics context since the last finished picture
    /** @type {Stage | null} */ #stage = null;
    /** @type {ShownModel | null} */ #model = null;
    /** @type {Camera | null} */ #camera = null; // kept while the element is out of view
    #shown = false; // whether the poster has gone
    #dismissed = false;
    #time = 0;
    /** @type {boolean | null} */ #plays = null; // what a script asked for; null: see `autoplay`
    #turns = true; // until the visitor moves the shape
    #away = 0;
    #tree;
    #watchers;
    #drawer; // of contexts.js

    constructor() {
        super();
        this.#tree = new ElementTree(this);
        this.#watchers = [
            new IntersectionObserver(([...all]) => this.#seen(all.at(-1).isIntersecting), {rootMargin: NEAR_VIEW}),
            new ResizeObserver(() => (this.#stage ? this.#stage.resize() : this.#wake())),
        ];
        this.#drawer = {
            open: () => this.#open(),
            rest: () => this.#free(),
            resize: () => this.#stage?.resize(),
            idleness: () => (this.#near ? Number(this.#isIdle()) : 2),
        };
        for (const type of ["pointerenter", "focusin"]) this.addEventListener(type, () => this.#wake());
    }

    connectedCallback() {
        adoptProperties(this);
        this.#connected = true;
        for (const watcher of this.#watchers) watcher.observe(this);
        this.#showPoster();
        this.#apply();
        this.#beginInTime();
    }

    disconnectedCallback() {
        for (const watcher of this.#watchers) watcher.disconnect();
        clearTimeout(this.#away);
        this.#connected = this.#near = false;
        this.#free();
    }

    /** @param {string} name @param {string | null} before @param {string | null} value */
    attributeChangedCallback(name, before, value) {
        const isModel = name === "src" || name === "model";
        if (before === value && !(isModel && this.#failed)) return;
        if (isModel) this.#restart();
        else if (name === "poster") this.#showPoster();
        else if (name === "camera-orbit") this.#place(true);
        else if (CONTROLS.includes(name)) this.#free(); // a new canvas, since listeners cannot be taken off the old one
        else if (TURNS.includes(name)) this.#turn(true);
        else if (name === "autoplay") this.#autoplay();
        else this.#apply();
        if (isModel || name === "loading") this.#beginInTime();
        this.#wake();
    }

    // Whether the model is loaded, and whether it is seen instead of the poster.
    get loaded() {
        return this.#model !== null;
    }

    get modelIsVisible() {
        return this.#shown;
    }

    // Time of a moving model, from 0 to 1.
    get currentTime() {
        return this.#stage?.options.time ?? this.#time;
    }

    set currentTime(time) {
        this.#time = Math.min(1, Math.max(0, Number(time)));
        this.#stage?.set({time: this.#time}, true);
        this.#wake();
    }

    get paused() {
        return !this.#stage?.playing;
    }

    play() {
        this.#plays = true;
        this.#stage?.play();
        this.#wake();
    }

    pause() {
        this.#plays = false;
        this.#stage?.pause();
    }

    // Returns {theta, phi: radians; radius: model units}.
    getCameraOrbit() {
        return this.#stage ? writtenOrbit(this.#stage.view, this.#stage.distance) : null;
    }

    dismissPoster() {
        this.#dismissed = true;
        this.#begin();
        this.#reveal();
    }

    showPoster() {
        this.#dismissed = false;
        this.#cover();
    }

    // Resolves to the refined picture as a PNG. Rejects before the model is drawn, and where the element loses its context.
    async toBlob() {
        if (!this.#stage || !this.#model) throw new Error("no picture: the element has not loaded, or is out of view");
        return this.#stage.renderer.png();
    }

    /** Returns whether no listener prevents what follows. @param {string} type */
    #tell(type, detail = {}, cancelable = false) {
        return this.dispatchEvent(new CustomEvent(type, {detail, cancelable}));
    }

    /** @param {Error} sourceError */
    #fail(sourceError, type = "loadfailure") {
        this.#failed = true;
        if (!this.#tell("error", {type, sourceError}, true)) return;
        this.#tree.say(sourceError.message);
        console.warn(`mplicits-view: ${sourceError.message}`);
    }

    /** Draws no more, until another model is set. @param {Error} error @param {string} [type] */
    #giveUp(error, type) {
        this.#cover();
        this.#free();
        this.#fail(error, type);
    }

    /** @param {boolean} isNear */
    #seen(isNear) {
        this.#near = isNear;
        clearTimeout(this.#away);
        if (isNear) this.#begin();
        else this.#away = setTimeout(() => this.#free(), AWAY);
    }

    #beginInTime() {
        if (this.#near || (this.#connected && this.loading === "eager")) this.#begin();
    }

    // Draws again what rests.
    #wake() {
        if (this.#near && this.#model) this.#begin();
    }

    #isIdle() {
        const {renderer, turning, playing} = /** @type {Stage} */ (this.#stage);
        const isInUse = this.matches(":hover") || this.#tree.shadow.activeElement;
        return this.#shown && (renderer.settled || turning || playing) && !isInUse;
    }

    // Loads the model, and draws it if the element is in view.
    async #begin() {
        if (!this.#load) {
            this.#load = new AbortController();
            const {signal} = this.#load;
            const failed = (/** @type {any} */ error) => signal.aborted || this.#fail(error);
            try {
                const model = await findModel(this.src, this.model, MplicitsView.models, signal, failed);
                if (signal.aborted) return;
                this.#model = model;
                this.#failed = false;
                this.#tree.say("");
                this.#showPoster();
            } catch (error) {
                if (!signal.aborted) this.#load = null;
                return failed(error);
            }
        }
        const isSeen = this.#near && this.offsetWidth && this.offsetHeight;
        if (this.#model && !this.#failed && isSeen && !this.#stage && !this.#isKept) askToDraw(this.#drawer);
    }

    // Whether the poster stays until a script dismisses it.
    get #isKept() {
        return this.reveal === "manual" && !this.#dismissed;
    }

    async #open() {
        const canvas = this.#tree.open();
        let began = 0; // when it drew first
        /** @type {Stage | null} */ let stage = null;
        try {
            stage = this.#stage = new Stage(canvas, {
                loaded: () => {
                    this.#turn();
                    this.#autoplay();
                    this.#tell("load", {url: this.src ?? ""});
                },
                frame: ({settled, size}) => {
                    const now = performance.now();
                    if (settled || began || size[1] > canvas.height / 3) this.#reveal();
                    began ||= now;
                    if (settled || now - began > STEADY) this.#losses = 0;
                    giveTurns();
                },
                moved: (isByVisitor) => {
                    this.#camera = stage?.camera ?? null;
                    this.#turns &&= !isByVisitor;
                    this.#tell("camera-change", {source: isByVisitor ? "user-interaction" : "automatic"});
                },
                lost: () => {
                    began = 0;
                    this.#cover();
                    if (++this.#losses > 1) return this.#giveUp(new Error(LOST), "webglcontextlost");
                    this.#tree.say(RESET);
                },
                failed: (error) => this.#giveUp(error),
            });
            const model = stage.model = /** @type {ShownModel} */ (this.#model);
            stage.resize();
            this.#listen();
            this.#place(!this.#camera);
            this.#apply();
            stage.options.time = this.#time;
            await stage.show(model);
        } catch (error) {
            if (stage === this.#stage) this.#giveUp(/** @type {Error} */ (error));
        }
    }

    #listen() {
        const moves = this.cameraControls;
        this.#tree.describe(this.alt ?? this.#model?.name ?? "", moves);
        if (moves) this.#stage?.listen(!this.disableZoom, !this.disablePan, this.touchAction === "none");
    }

    // Sets shading, level and background from the attributes.
    #apply() {
        const {shade, level} = this, background = this.#tree.paint(this.background ?? "");
        const shading = shade ? facts.old_shades[shade] ?? shade : "";
        if (shade && shading !== shade) console.warn(`mplicits-view: shade="${shade}" is now shade="${shading}"`);
        this.#stage?.set({shading, level: level && level >= 1 ? level : Infinity, background});
    }

    /** Moves the camera to its attribute, or back to where it was. @param {boolean} isFromAttribute */
    #place(isFromAttribute) {
        const stage = this.#stage, text = this.cameraOrbit;
        if (isFromAttribute) this.#camera = stage && text ? readOrbit(text, stage.home, stage.distance) : null;
        if (!stage) return;
        stage.camera = this.#camera;
        stage.draw(true);
    }

    #turn(isAnew = false) {
        this.#turns ||= isAnew;
        this.#stage?.turntable(this.#turns && isMotionWelcome() ? readTurn((name) => this.getAttribute(name)) : 0);
    }

    #autoplay() {
        const plays = this.#plays ?? (this.autoplay && isMotionWelcome()), stage = this.#stage;
        if (plays && this.#model?.inputs === "xyzt") stage?.play();
        else stage?.pause();
    }

    #showPoster() {
        this.#tree.picture(this.poster ?? this.#model?.poster ?? null);
    }

    #cover() {
        this.#shown = false;
        this.#tree.poster.hidden = false;
    }

    #reveal() {
        if (this.#isKept || !this.#stage) return;
        this.#tree.settle();
        this.#tree.say("");
        if (this.#shown) return;
        this.#shown = true;
        this.#tree.poster.hidden = true;
        this.#tell("poster-dismissed");
    }

    #restart() {
        this.#free();
        this.#load?.abort();
        this.#load = this.#model = this.#camera = null;
        this.#failed = false;
        this.#losses = 0;
        this.#turns = true;
        this.#tree.still.hidden = true;
        this.#tree.say("");
        this.#showPoster();
        this.showPoster();
    }

    // Gives the graphics context back, and leaves the last picture.
    #free() {
        endDrawing(this.#drawer);
        const stage = this.#stage;
        this.#tree.close(stage && this.#shown && !stage.renderer.device.lost ? stage.picture() : null);
        if (!stage) return;
        this.#time = stage.options.time;
        stage.free();
        this.#stage = null;
    }
}

addProperties(MplicitsView.prototype);
