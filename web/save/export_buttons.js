import {saveFile} from "../view/controls.js";
import {copyShadertoy} from "../view/current_model.js";

/** A way to keep a trained shape. Its button says its bytes as soon as they are known. isQuick: it is made at once;
 * isCopied: a text for the clipboard, not for a file; isAnew: each click makes it.
 * @typedef {string | Blob | Uint8Array<ArrayBuffer>} Content
 * @typedef {{id: string, label: string, title?: string, ending?: string, make: () => Content | Promise<Content>,
 *     isQuick?: boolean, isCopied?: boolean, isAnew?: boolean, element?: undefined}} Saved */
/** The same, or a control among the buttons. @typedef {Saved | {element: HTMLElement, id?: undefined}} Kind */

/** Fills a row with buttons.
 * @param {HTMLElement} row @param {string} name of the files @param {Kind[]} kinds @param {(id: string) => void} onSave
 * @param {(action: () => Promise<unknown>) => () => void} guarded see studio.js */
export function showExports(row, name, kinds, onSave, guarded) {
    row.replaceChildren(...kinds.map((kind) => {
        if (kind.element) return kind.element;
        const button = document.createElement("button"),
            {id, label, title = "", ending = "", make, isQuick, isCopied, isAnew} = kind;
        /** @type {Promise<Content> | null} */
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
                        await copyShadertoy(/** @type {string} */ (value));
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

/** @param {Content} value */
function readableSize(value) {
    const bytes = new Blob([value]).size;
    return bytes < 1e6 ? `${(bytes / 1000).toFixed(1)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}
