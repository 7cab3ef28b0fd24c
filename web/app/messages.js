import {DeviceError} from "./device.js";
import {ModelError} from "./safetensors.js";

// What the page tells: a message, the status line and the bar, and its state, as data attributes of the root element.
export const element = (id) => document.getElementById(id);
export const root = document.documentElement;

// Shows a message, or hides it where the text is empty.
export function say(text, closable = true) {
    const box = element("message");
    box.querySelector("p").textContent = text;
    box.querySelector("button").hidden = !closable;
    box.hidden = !text;
}

// Whether an error's message is written for the visitor.
export const isExpected = (error) => error instanceof DeviceError || error instanceof ModelError;

export function fail(error) {
    const expected = isExpected(error), text = expected ? error.message
        : `This page came upon something it does not know: ${error.message}`;
    say(text, expected && "drawn" in root.dataset);
    enter("failed", "");
    if (!expected) throw error;
}

let line = "", field = "", trial = ""; // the status line's parts
let isAwaited = true; // whether the picture that is being drawn will be spoken of
let isOther = false; // whether the visitor asked for another picture than the poster's

// Changes the state: "compiling", "drawing", "still", "lost" or "failed". text: the status line's first half. share: of
// the work that is done, for the bar; NaN: unknown, null: no bar.
export function enter(state, text, share = null) {
    root.dataset.state = state;
    line = text;
    tell();
    const bar = element("progress");
    bar.hidden = share === null;
    bar.setAttribute("aria-label", text.split(" · ")[0]);
    if (share >= 0) bar.setAttribute("aria-valuenow", String(Math.round(100 * share)));
    else bar.removeAttribute("aria-valuenow");
    bar.style.setProperty("--share", String(share || 0));
}

function tell() {
    element("status").textContent = [line, field && [field, trial].filter(Boolean).join(" · ")].filter(Boolean).join("\n");
}

// What a screen reader says: not each step of the status line, only that a model's first picture begins and is there.
function speak(text) {
    element("spoken").textContent = text;
}

// Begins the time in which a model's shader is compiled; listener.stored ends it.
export function compiling() {
    isAwaited = true;
    field = trial = "";
    enter("compiling", "Compiling the shader", NaN);
    speak("Compiling the shader");
}

// Has the next frame take the poster's place, however coarse it is.
export function uncover() {
    isOther = true;
}

// Begins a picture, unless the state says that none can be drawn yet.
export function drawing() {
    if (root.dataset.state === "still") enter("drawing", "Drawing");
}

const dimensions = ([width, height]) => `${width} × ${height}`;

// What the renderer calls.
export const listener = {
    frame({milliseconds, size, samples, settled}) {
        const poster = element("poster"), isFiner = size[1] >= poster.naturalHeight || samples > 1 || settled;
        if (isFiner || isOther || poster.hidden) root.dataset.drawn = "";
        if (root.dataset.state === "compiling") return;
        const time = milliseconds < 10 ? `${milliseconds.toFixed(1)} ms`
            : milliseconds < 1000 ? `${Math.round(milliseconds)} ms` : `${(milliseconds / 1000).toFixed(1)} s`;
        const sampled = samples > 1 ? ` · ${samples} samples` : "";
        enter(settled ? "still" : "drawing", `${time} · ${dimensions(size)}${sampled}`);
        if (settled && isAwaited) {
            speak("The picture is drawn");
            isAwaited = false;
        }
    },
    // A share of the first sample of every pixel is drawn.
    progress(size, share) {
        if (share > 0.5) root.dataset.drawn = "";
        if (root.dataset.state === "compiling") return;
        enter("drawing", `Drawing ${dimensions(size)} · ${Math.floor(100 * share)} %`, share);
    },
    stored(storage, error) {
        root.dataset.storage = storage;
        const off = error === null ? "field error not measurable here" : `field error ${error.toExponential(1)}`;
        field = `${off} · weights as ${storage === "literal" ? "literals" : "a texture"}`;
        if (error !== null) root.dataset.error = String(error);
        if (root.dataset.state === "compiling") enter("drawing", "Drawing", NaN);
        else tell();
    },
    // A second variant is compiled and compared, or no longer.
    trying(isTried) {
        trial = isTried ? "trying literals" : "";
        tell();
    },
    failed: fail,
};
