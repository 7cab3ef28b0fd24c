import {DeviceError} from "./device.js";
import {ModelError} from "./safetensors.js";

// What the page tells: a message, the status line, and its state, as data attributes of the root element.
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
    const expected = isExpected(error);
    say(expected ? error.message : `This page came upon something it does not know: ${error.message}`, expected);
    root.dataset.state = "failed";
    if (!expected) throw error;
}

let quality = ""; // the status line's second half

// What the renderer calls.
export const listener = {
    frame({milliseconds, size, samples, settled}) {
        const time = milliseconds < 10 ? `${milliseconds.toFixed(1)} ms`
            : milliseconds < 1000 ? `${Math.round(milliseconds)} ms` : `${(milliseconds / 1000).toFixed(1)} s`;
        const sampled = samples > 1 ? ` · ${samples} samples` : "";
        element("status").textContent = `${time} · ${size[0]} × ${size[1]}${sampled}\n${quality}`;
        if (settled) root.dataset.state = "still";
    },
    stored(storage, error) {
        root.dataset.storage = storage;
        const off = error === null ? "field error not measurable here" : `field error ${error.toExponential(1)}`;
        quality = `${off} · weights as ${storage === "literal" ? "literals" : "a texture"}`;
        if (error !== null) root.dataset.error = String(error);
    },
    failed: fail,
};
