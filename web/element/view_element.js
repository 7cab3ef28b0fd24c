import {ElementTree} from "./element_tree.js";
import {findModel} from "./models.js";
import {isMotionWelcome, readOrbit, readTurn, writtenOrbit} from "./orbits.js";
import {Stage} from "./stage.js";

// <mplicits-view>: a model in a page. Attributes and events are those of Google's <model-viewer> where they mean the
// same; docs/engines.md lists them. A graphics context exists only while the element is in view.
const NEAR_VIEW = "200px"; // distance from the window at which an element begins
const AWAY = 1000; // milliseconds out of view after which an element frees its context
const CONTROLS = ["camera-controls", "disable-zoom", "disable-pan", "alt"];
const TURNS = ["turntable", "auto-rotate", "rotation-per-second"];

export class MplicitsView extends HTMLElement {
    static observedAttributes = ["src", "model", "poster", "shade", "level", "background", "camera-orbit", ...CONTROLS, ...TURNS];
    static models = new Map(); // of the modules of the page, by name
    #near = false;
    #load = null; // AbortController of the current model
    #stage = null;
    #model = null;
    #camera = null; // kept while the element is out of view
    #shown = false; // whether the poster has gone
    #dismissed = false;
    #time = 0;
    #away = 0;
    #tree;
    #watchers;

    constructor() {
        super();
        this.#tree = new ElementTree(this);
        this.#watchers = [
            new IntersectionObserver(([...all]) => this.#seen(all.at(-1).isIntersecting), {rootMargin: NEAR_VIEW}),
            new ResizeObserver(() => this.#stage?.resize()),
        ];
    }

    connectedCallback() {
        for (const watcher of this.#watchers) watcher.observe(this);
        this.#showPoster();
        if (this.getAttribute("loading") === "eager") this.#begin();
    }

    disconnectedCallback() {
        for (const watcher of this.#watchers) watcher.disconnect();
        clearTimeout(this.#away);
        this.#near = false;
        this.#free();
    }

    attributeChangedCallback(name, before, value) {
        if (before === value || !this.isConnected) return;
        if (name === "poster") this.#showPoster();
        else if (name === "src" || name === "model") this.#restart();
        else if (name === "camera-orbit") this.#place(true);
        else if (CONTROLS.includes(name)) this.#rebuild();
        else if (TURNS.includes(name)) this.#turn();
        else if (this.#stage) this.#apply();
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
    }

    get paused() {
        return !this.#stage?.playing;
    }

    play() {
        this.#stage?.play();
    }

    pause() {
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
        this.#dismissed = this.#shown = false;
        this.#tree.poster.hidden = false;
    }

    // Resolves to the refined picture as a PNG. Rejects before the model is drawn.
    async toBlob() {
        if (!this.#stage || !this.#model) throw new Error("no picture: the element has not loaded, or is out of view");
        return this.#stage.renderer.png();
    }

    #tell(type, detail = {}) {
        this.dispatchEvent(new CustomEvent(type, {detail}));
    }

    #fail(error) {
        if (error.name === "AbortError") return;
        const event = new CustomEvent("error", {detail: {type: "loadfailure", sourceError: error}});
        if (this.dispatchEvent(event)) console.warn(`mplicits-view: ${error.message}`);
    }

    #seen(isNear) {
        this.#near = isNear;
        clearTimeout(this.#away);
        if (isNear) this.#begin();
        else this.#away = setTimeout(() => this.#free(), AWAY);
    }

    // Loads the model, and draws it if the element is in view.
    async #begin() {
        if (!this.#load) {
            this.#load = new AbortController();
            const {signal} = this.#load;
            try {
                const model = await findModel(this.getAttribute("src"), this.getAttribute("model"), MplicitsView.models, signal);
                if (signal.aborted) return;
                this.#model = model;
                this.#showPoster();
            } catch (error) {
                return signal.aborted || this.#fail(error);
            }
        }
        const isAllowed = this.getAttribute("reveal") !== "manual" || this.#dismissed;
        if (this.#model && this.#near && !this.#stage && isAllowed) await this.#open();
    }

    async #open() {
        const canvas = this.#tree.open();
        let isFirst = true;
        try {
            this.#stage = new Stage(canvas, {
                frame: ({settled, size}) => {
                    if (settled || !isFirst || size[1] > canvas.height / 3) this.#reveal();
                    isFirst = false;
                },
                moved: (isByVisitor) => {
                    this.#camera = this.#stage.camera;
                    this.#tell("camera-change", {source: isByVisitor ? "user-interaction" : "automatic"});
                },
                failed: (error) => this.#fail(error),
            });
            const stage = this.#stage;
            stage.model = this.#model;
            stage.resize();
            this.#listen();
            this.#place(!this.#camera);
            this.#apply();
            stage.options.time = this.#time;
            await stage.show(this.#model);
            if (stage !== this.#stage || stage.isFreed) return;
            this.#turn();
            if (this.hasAttribute("autoplay") && this.#model.inputs === "xyzt" && isMotionWelcome()) stage.play();
            this.#tell("load", {url: this.getAttribute("src") ?? ""});
        } catch (error) {
            this.#free();
            this.#fail(error);
        }
    }

    #listen() {
        const moves = this.hasAttribute("camera-controls");
        this.#tree.describe(this.getAttribute("alt") ?? this.#model.name, moves);
        if (moves) this.#stage.listen(!this.hasAttribute("disable-zoom"), !this.hasAttribute("disable-pan"));
    }

    // Sets shading, level and background from the attributes.
    #apply() {
        const text = this.getAttribute("shade"), level = Number(this.getAttribute("level"));
        this.#tree.paint(this.#stage.setBackground(this.getAttribute("background") ?? ""));
        this.#stage.set({...(text && {shading: text}), level: level >= 1 ? level : Infinity});
    }

    // Moves the camera to its attribute, or back to where it was.
    #place(isFromAttribute) {
        const stage = this.#stage, text = this.getAttribute("camera-orbit");
        if (!stage) return;
        if (isFromAttribute) this.#camera = text ? readOrbit(text, stage.home, stage.distance) : null;
        stage.camera = this.#camera;
        stage.draw(true);
    }

    #turn() {
        this.#stage?.turntable(isMotionWelcome() ? readTurn((name) => this.getAttribute(name)) : 0);
    }

    #showPoster() {
        this.#tree.picture(this.getAttribute("poster") ?? this.#model?.poster ?? null);
    }

    #reveal() {
        const isManual = this.getAttribute("reveal") === "manual" && !this.#dismissed;
        if (isManual || !this.#stage) return;
        this.#tree.still.hidden = true;
        if (this.#shown) return;
        this.#shown = true;
        this.#tree.poster.hidden = true;
        this.#tell("poster-dismissed");
    }

    #restart() {
        this.#free();
        this.#load?.abort();
        this.#load = this.#model = this.#camera = null;
        this.#tree.still.hidden = true;
        this.showPoster();
        if (this.#near || this.getAttribute("loading") === "eager") this.#begin();
    }

    // Draws on a new canvas, since listeners cannot be taken off the old one.
    #rebuild() {
        if (!this.#stage) return;
        this.#free();
        this.#begin();
    }

    // Gives the graphics context back, and leaves the last picture.
    #free() {
        const stage = this.#stage;
        this.#tree.close(stage && this.#shown && !stage.renderer.device.lost ? stage.picture() : null);
        if (!stage) return;
        this.#time = stage.options.time;
        stage.free();
        this.#stage = null;
    }
}
