// What an element shows: the canvas of its drawing, the last picture while it is away, and the poster before both.
const STYLE = `
:host { display: block; position: relative; width: 300px; height: 300px; contain: strict; }
:host([hidden]) { display: none; }
canvas, .poster, .poster > *, ::slotted([slot="poster"]) { position: absolute; inset: 0; width: 100%; height: 100%; }
.poster img { object-fit: contain; }
.poster, .still { pointer-events: none; }
[hidden] { display: none; }
.controls { touch-action: pan-y; cursor: grab; }
.controls:active { cursor: grabbing; }
.controls:focus-visible { outline: 2px solid; outline-offset: -2px; }`;
const LABELS = "arrow keys turn it, plus and minus zoom, R resets the view";

export class ElementTree {
    constructor(host) {
        const shadow = host.attachShadow({mode: "open"}), style = new CSSStyleSheet();
        style.replaceSync(STYLE);
        shadow.adoptedStyleSheets = [style];
        const [poster, slot, image, still] = ["div", "slot", "img", "canvas"].map((tag) => document.createElement(tag));
        poster.className = "poster";
        poster.part = "poster";
        Object.assign(slot, {name: "poster"});
        image.alt = "";
        slot.append(image);
        poster.append(slot);
        Object.assign(still, {className: "still", hidden: true});
        shadow.append(still, poster);
        Object.assign(this, {shadow, poster, image, still, canvas: null});
    }

    // Adds a canvas, below the last picture and the poster.
    open() {
        this.canvas = document.createElement("canvas");
        this.shadow.prepend(this.canvas);
        return this.canvas;
    }

    // Removes the canvas. picture: what stays in its place, a canvas, or null. It has the canvas's place among the controls.
    close(picture) {
        const {canvas, still} = this;
        if (picture) {
            const {width, height, tabIndex} = canvas;
            Object.assign(still, {width, height, tabIndex, hidden: false});
            for (const name of ["role", "aria-label"]) still.setAttribute(name, canvas.getAttribute(name));
            still.getContext("2d").drawImage(picture, 0, 0);
        }
        canvas?.remove();
        this.canvas = null;
    }

    // The canvas takes the place of the last picture.
    settle() {
        const {canvas, still, shadow} = this;
        if (shadow.activeElement === still) canvas.focus({preventScroll: true});
        still.hidden = true;
    }

    // Tells screen readers what the canvas is. moves: whether a visitor can move the shape.
    describe(text, moves) {
        const {canvas} = this;
        canvas.className = moves ? "controls" : "";
        canvas.setAttribute("role", moves ? "application" : "img");
        canvas.setAttribute("aria-label", moves ? `${text}: ${LABELS}` : text);
        if (moves) canvas.tabIndex = 0;
    }

    // Sets the picture of the poster, where the page has none. url: null for none.
    picture(url) {
        this.image.hidden = !url;
        if (url) this.image.src = url;
    }

    // Paints the poster's background as that of the drawing.
    paint({bottom, top}) {
        const css = (color) => `rgb(${color.map((c) => Math.round(255 * c)).join(" ")})`;
        this.poster.style.background = `linear-gradient(${css(top)}, ${css(bottom)})`;
    }
}
