import {BACKGROUNDS, plainBackground} from "../draw/backgrounds.js";

// What an element shows: the canvas of its drawing, the last picture while it is away, the poster before both, and a line
// where it fails.
const STYLE = `
:host { display: block; position: relative; width: 300px; height: 300px; contain: strict; }
:host([hidden]) { display: none; }
canvas, .poster, .poster img, ::slotted([slot="poster"]) { position: absolute; inset: 0; width: 100%; height: 100%; }
.poster img, ::slotted([slot="poster"]) { object-fit: contain; }
.poster, .still { pointer-events: none; }
[hidden] { display: none; }
.controls { touch-action: pan-y; cursor: grab; }
:host([disable-zoom][disable-pan]) .controls { touch-action: pan-y pinch-zoom; }
:host([touch-action="none"]) .controls { touch-action: none; }
.controls:active { cursor: grabbing; }
.controls:focus-visible { outline: 2px solid; outline-offset: -2px; }
.note { position: absolute; inset: auto 0 0; max-height: 60%; overflow: auto; box-sizing: border-box; padding: 8px 12px;
font: 13px/1.4 system-ui, sans-serif; overflow-wrap: anywhere; color: #fff; background: rgb(0 0 0 / 75%); }
.note:empty { display: none; }`;
const LABELS = "arrow keys turn it, plus and minus zoom, R resets the view";

export class ElementTree {
    /** @type {HTMLCanvasElement | null} */ canvas = null;

    /** @param {HTMLElement} host */
    constructor(host) {
        const shadow = host.attachShadow({mode: "open"}), style = new CSSStyleSheet();
        style.replaceSync(STYLE);
        shadow.adoptedStyleSheets = [style];
        const [poster, slot, image, still, note] =
            /** @type {[HTMLElement, HTMLSlotElement, HTMLImageElement, HTMLCanvasElement, HTMLElement]} */ (
                ["div", "slot", "img", "canvas", "div"].map((tag) => document.createElement(tag))
            );
        poster.className = "poster";
        poster.part = "poster";
        Object.assign(slot, {name: "poster"});
        image.alt = "";
        slot.append(image);
        poster.append(slot);
        Object.assign(still, {className: "still", hidden: true});
        Object.assign(note, {className: "note", part: "note", role: "status"});
        shadow.append(still, poster, note);
        this.shadow = shadow;
        this.poster = poster;
        this.image = image;
        this.still = still;
        this.note = note;
    }

    // Adds a canvas, below the last picture and the poster.
    open() {
        this.canvas = document.createElement("canvas");
        this.shadow.prepend(this.canvas);
        return this.canvas;
    }

    /** Removes the canvas. picture: what stays in its place, a canvas, or null. It has the canvas's place among the
     * controls.
     * @param {HTMLCanvasElement | null} picture */
    close(picture) {
        const {canvas, still} = this;
        if (picture && canvas) {
            const {width, height, tabIndex} = canvas;
            Object.assign(still, {width, height, tabIndex, hidden: false});
            for (const name of ["role", "aria-label"]) still.setAttribute(name, canvas.getAttribute(name) ?? "");
            still.getContext("2d")?.drawImage(picture, 0, 0);
        }
        canvas?.remove();
        this.canvas = null;
    }

    // The canvas takes the place of the last picture.
    settle() {
        const {canvas, still, shadow} = this;
        if (shadow.activeElement === still) canvas?.focus({preventScroll: true});
        still.hidden = true;
    }

    /** Tells screen readers what the canvas is. moves: whether a visitor can move the shape.
     * @param {string} text @param {boolean} moves */
    describe(text, moves) {
        const canvas = /** @type {HTMLCanvasElement} */ (this.canvas);
        canvas.className = moves ? "controls" : "";
        canvas.setAttribute("role", moves ? "application" : "img");
        canvas.setAttribute("aria-label", moves ? `${text}: ${LABELS}` : text);
        if (moves) canvas.tabIndex = 0;
    }

    /** Sets the picture of the poster, where the page has none. url: null for none. @param {string | null} url */
    picture(url) {
        this.image.hidden = !url;
        if (url) this.image.src = url;
    }

    /** Shows a line, or none. @param {string} text */
    say(text) {
        if (this.note.textContent !== text) this.note.textContent = text;
    }

    /** Paints the poster's background as that of the drawing, which it returns: [bottom, top]. name: of BACKGROUNDS,
     * or rrggbb; else the background that fits the visitor's color scheme.
     * @param {string} name */
    paint(name) {
        const usual = matchMedia("(prefers-color-scheme: light)").matches ? "paper" : "slate";
        const known = Object.hasOwn(BACKGROUNDS, name) ? BACKGROUNDS[name] : plainBackground(name);
        const {bottom, top} = known ?? BACKGROUNDS[usual];
        const css = (/** @type {Vector} */ color) => `rgb(${color.map((c) => Math.round(255 * c)).join(" ")})`;
        this.poster.style.background = `linear-gradient(${css(top)}, ${css(bottom)})`;
        return [bottom, top];
    }
}
