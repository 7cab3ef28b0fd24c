import {saveFile} from "../view/controls.js";
import {copyShadertoy} from "../view/current_model.js";

// The ways to keep a trained shape. Each is a button that says its bytes as soon as they are known.

// Fills a row with a button for each kind {id, label, title, ending, make, isQuick, isCopied}. make: returns a string, an
// array of bytes or a Blob, or a promise of one; isQuick: it is made at once; isCopied: a text for the clipboard, not for
// a file; isAnew: each click makes it. {element}: a control among the buttons. name: of the files. onSave: called with the kind's id. guarded: see studio.js.
export function showExports(row, name, kinds, onSave, guarded) {
    row.replaceChildren(...kinds.map((kind) => {
        if (kind.element) return kind.element;
        const button = document.createElement("button"),
            {id, label, title = "", ending, make, isQuick, isCopied, isAnew} = kind;
        let made = null;
        const content = () => (made ??= Promise.resolve().then(make).then((value) => {
            button.textContent = `${label} · ${readableSize(value)}`;
            return value;
        }).catch((error) => {
            made = null; // the next click tries again
            throw error;
        }));
        Object.assign(button, {type: "button", id, title, textContent: label});
        button.addEventListener(
            "click",
            guarded(async () => {
                button.disabled = true;
                try {
                    const value = await content();
                    if (isCopied) {
                        await copyShadertoy(value);
                    } else {
                        saveFile(new Blob([value]), name, ending);
                    }
                    if (isAnew) made = null;
                    onSave(id);
                } finally {
                    button.disabled = false;
                }
            }),
        );
        if (isQuick) guarded(content)();
        return button;
    }));
}

function readableSize(value) {
    const bytes = value.size ?? value.byteLength ?? new Blob([value]).size;
    return bytes < 1e6 ? `${(bytes / 1000).toFixed(1)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}
