import {facts, shared} from "../model/facts.js";
import {parseModel} from "../model/safetensors.js";
import {lowered, widest} from "../print/lower_model.js";
import {probes} from "../print/reference.js";

// Writes the page of a model from this page's own text, which a packed page keeps (Parts of web/document.py).
// deno-lint-ignore no-control-regex -- marks that no text has
const STUDIO_PARTS = /\x01[st][\d,]+\x01/g;
const NO_PICTURE = "data:,", MARK = "\x01";

export const canWritePage = Boolean(globalThis.packedPage);

/** Resolves to the HTML of the packed page, as `mplicits bake --target html` would write it. Throws ModelError.
 * @param {Uint8Array<ArrayBuffer>} bytes a model file @param {number} ground height of the lowest point
 * @param {string} shade first shading @param {string} poster of posterOf (poster.js) */
export async function pageText(bytes, ground, shade, poster = NO_PICTURE) {
    const {viewer} = facts.studio, model = parseModel(bytes.slice().buffer, true);
    const parsed = (/** @type {string} */ text) => new DOMParser().parseFromString(text, "text/html");
    const outer = parsed(packedPage.outer), page = parsed(packedPage.html.replace(STUDIO_PARTS, ""));
    /** @param {string} attribute @returns {HTMLMetaElement} */
    const meta = (attribute) => /** @type {HTMLMetaElement} */ (outer.querySelector(`meta[${attribute}]`));
    const policy = meta("http-equiv"), studio = new RegExp(` \\S+${viewer.policy}`); // with the hash of its script
    policy.content = policy.content.replace(studio, "");
    meta('property="og:title"').content = model.name.replaceAll(MARK, "");
    meta("name=description").content = viewer.description;
    for (const one of [outer, page]) {
        const picture = one.getElementById("poster");
        one.title = model.name.replaceAll(MARK, "");
        picture.setAttribute("src", one === outer ? poster : `${MARK}p${MARK}`);
        picture.hidden = poster === NO_PICTURE;
    }
    delete page.documentElement.dataset.state;
    page.getElementById("file").accept = viewer.accept;
    page.querySelector(".hint").textContent = viewer.hint;
    const texts = {
        open: viewer.open,
        weights: `${MARK}b0,${bytes.length}${MARK}`,
        facts: JSON.stringify(await factsOf({...model, ground}, bytes, shade)).replaceAll("<", "\\u003c"),
    };
    for (const [id, text] of Object.entries(texts)) page.getElementById(id).textContent = text;
    outer.getElementById("packed").textContent = await packed124(new Blob([written(page), "\0", bytes]));
    return written(outer);
}

/** @param {Document} page */
const written = (page) => `<!doctype html>\n${page.documentElement.outerHTML}\n`;

/** Resolves to the facts of web/page.py. Their hash is that of the file, and empty where the browser offers none.
 * @param {ShownModel} model @param {Uint8Array<ArrayBuffer>} bytes @param {string} shade */
async function factsOf(model, bytes, shade) {
    const {mplicits, target} = facts, {name, front, credit, levels} = model, {values, texture} = lowered(model);
    const narrowest = Math.min(...[...values, ...(texture ? [texture] : [])].map(widest));
    const hash = new Uint8Array(await crypto.subtle?.digest("SHA-256", bytes) ?? 0);
    return {
        mplicits,
        target,
        name,
        front,
        credit,
        shade,
        shared,
        ...probes(model),
        sha256: Array.from(hash, (byte) => byte.toString(16).padStart(2, "0")).join(""),
        levels: levels.map(({network}) => `${network[0].rows}x${network.length - 2}`),
        ground: Number(model.ground.toFixed(4)),
        storage: narrowest <= shared.storages[0][0] ? "auto" : "texture",
    };
}

/** Resolves to a blob's deflate stream as text of base 124, which view/packed.html reads. @param {Blob} blob */
export async function packed124(blob) {
    const stream = blob.stream().pipeThrough(new CompressionStream("deflate-raw"));
    const data = new Uint8Array(await new Response(stream).arrayBuffer());
    let text = "";
    for (let i = 0; i < data.length; i += 869) {
        const group = data.subarray(i, i + 869), digits = [];
        let value = BigInt("0x" + Array.from(group, (byte) => byte.toString(16).padStart(2, "0")).join(""));
        for (let k = Math.ceil(group.length * 1000 / 869); k > 0; --k) {
            const code = Number(value % 124n) + 1, later = code + Number(code > 12);
            digits.push(String.fromCharCode(later + Number(later > 59)));
            value /= 124n;
        }
        text += digits.reverse().join("");
    }
    return text;
}
