import {DeviceError} from "../draw/device.js";
import {ModelError} from "../model/safetensors.js";

/** Messages, the status line with its bar, and the state of the page, as data attributes of the root element.
 * @template {string} Id @param {Id} id */
export const element = (id) => document.getElementById(id);
export const root = document.documentElement;

/** Shows a message; hides it for an empty text. @param {string} text */
export function say(text, closable = true) {
    const box = element("message");
    box.querySelector("p").textContent = text;
    box.querySelector("button").hidden = !closable;
    box.hidden = !text;
}

// Closes the message, unless it has to stay.
export function dismiss() {
    if (!element("message").querySelector("button").hidden) say("");
}

/** Whether the visitor can understand an error's message. @param {unknown} error @returns {boolean} */
export const isExpected = (error) => error instanceof DeviceError || error instanceof ModelError;

/** @param {any} error */
export function fail(error) {
    const expected = isExpected(error),
        text = expected ? error.message : `Unexpected error in this page: ${error.message}`;
    say(text, expected && "drawn" in root.dataset);
    setState("failed", "");
    if (!expected) throw error;
}

let line = "", field = "", trial = ""; // parts of the status line
let isAwaited = true; // whether to announce the next finished picture
let isOther = false; // whether the view differs from the poster's

/** Sets the state: "compiling", "drawing", "still", "lost" or "failed". text: first half of the status line. share:
 * progress for the bar; NaN: unknown, null: no bar.
 * @param {string} state @param {string} text @param {number | null} share */
export function setState(state, text, share = null) {
    root.dataset.state = state;
    line = text;
    updateStatus();
    const bar = element("progress");
    bar.hidden = share === null;
    bar.setAttribute("aria-label", text.split(" · ")[0]);
    if (share !== null && share >= 0) bar.setAttribute("aria-valuenow", String(Math.round(100 * share)));
    else bar.removeAttribute("aria-valuenow");
    bar.style.setProperty("--share", String(share || 0));
}

function updateStatus() {
    element("status").textContent = [line, field && [field, trial].filter(Boolean).join(" · ")].filter(Boolean).join(
        "\n",
    );
}

/** The text for screen readers: only that a model's first picture begins, and that it is complete.
 * @param {string} text */
function announce(text) {
    element("spoken").textContent = text;
}

// Shows that a model's shader compiles. listener.stored ends this state.
export function compiling() {
    isAwaited = true;
    field = trial = "";
    setState("compiling", "Compiling the shader", NaN);
    announce("Compiling the shader");
}

// Lets the next frame replace the poster.
export function uncover() {
    isOther = true;
    if (root.dataset.state === "compiling")
        setState("compiling", "Compiling the shader · the view follows in a moment", NaN);
}

// Shows that a new picture begins, if the last picture is complete.
export function drawing() {
    if (root.dataset.state === "still") setState("drawing", "Drawing");
}

/** @param {number[]} size */
const dimensions = ([width, height]) => `${width} × ${height}`;

// Callbacks of the renderer.
/** @type {Omit<Listener, "loaded">} */
export const listener = {
    frame({milliseconds, size, samples, settled}) {
        const poster = element("poster"), isFiner = size[1] >= poster.naturalHeight || samples > 1 || settled;
        if (isFiner || isOther || poster.hidden) root.dataset.drawn = "";
        if (root.dataset.state === "compiling") return;
        const time = milliseconds < 10 ?
            `${milliseconds.toFixed(1)} ms`
            : milliseconds < 1000
            ? `${Math.round(milliseconds)} ms`
            : `${(milliseconds / 1000).toFixed(1)} s`;
        const sampled = samples > 1 ? ` · ${samples} samples` : "";
        setState(settled ? "still" : "drawing", `${time} · ${dimensions(size)}${sampled}`);
        if (settled && isAwaited) {
            announce("The picture is drawn");
            isAwaited = false;
        }
    },
    progress(size, share) {
        if (share > 0.5) root.dataset.drawn = "";
        if (root.dataset.state === "compiling") return;
        setState("drawing", `Drawing ${dimensions(size)} · ${Math.floor(100 * share)} %`, share);
    },
    stored(storage, error) {
        root.dataset.storage = storage;
        const off = error === null ? "field error not measurable here" : `field error ${error.toExponential(1)}`;
        field = `${off} · weights as ${storage === "literal" ? "literals" : "a texture"}`;
        if (error !== null) root.dataset.error = String(error);
        if (root.dataset.state === "compiling") setState("drawing", "Drawing", NaN);
        else updateStatus();
    },
    trying(isTried) {
        trial = isTried ? "trying literals" : "";
        updateStatus();
    },
    failed: fail,
};
