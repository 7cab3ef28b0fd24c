import {facts, shared} from "./facts.js";
import {lowered, widest} from "./lower.js";
import {probes} from "./reference.js";
import {parseModel} from "./safetensors.js";

// Writes the page of a model from this page's own text, which a packed page keeps (web/packed_page.py).
const STUDIO_PARTS = /(\/\*|<!-{2})studio(\*\/|-{2}>)[^]*?(\/\*|<!-{2})end(\*\/|-{2}>)\n?/g; // marks of web/page.py
const NO_PICTURE = "data:,", PART = "\x01"; // PART: see MARK in web/packed_page.py

export const canWritePage = Boolean(globalThis.packedPage);

// Resolves to the HTML of the packed page, as `mplicits bake --target html` would write it. bytes: Uint8Array, a model
// file. ground: height of the lowest point; shade: first shading; shadertoy: text to copy, or null; poster: of posterOf
// (poster.js). Throws ModelError.
export async function pageText(bytes, ground, shade, shadertoy = null, poster = NO_PICTURE) {
    const {viewer} = facts.studio, model = parseModel(bytes.slice().buffer, true);
    const parsed = (text) => new DOMParser().parseFromString(text, "text/html");
    const outer = parsed(packedPage.outer), page = parsed(packedPage.html.replace(STUDIO_PARTS, ""));
    for (const one of [outer, page]) {
        const policy = one.querySelector("meta[http-equiv]"), picture = one.getElementById("poster");
        policy.content = policy.content.replace(viewer.policy, "");
        one.title = model.name.replaceAll(PART, "");
        picture.setAttribute("src", one === outer ? poster : `${PART}poster${PART}`);
        picture.hidden = poster === NO_PICTURE;
    }
    delete page.documentElement.dataset.state;
    page.getElementById("file").accept = viewer.accept;
    page.querySelector(".hint").textContent = viewer.hint;
    const texts = {
        open: viewer.open, weights: `\n${PART}${bytes.length}${PART}\n`,
        facts: JSON.stringify(await factsOf({...model, ground}, bytes, shade, shadertoy)).replaceAll("<", "\\u003c"),
    };
    for (const [id, text] of Object.entries(texts)) page.getElementById(id).textContent = text;
    outer.getElementById("packed").textContent = `\n${await packed94(new Blob([written(page), "\0", bytes]))}\n`;
    return written(outer);
}

const written = (page) => `<!doctype html>\n${page.documentElement.outerHTML}\n`;

// Resolves to the facts of web/page.py. Their hash is that of the file, and empty where the browser offers none.
async function factsOf(model, bytes, shade, shadertoy) {
    const {mplicits, target} = facts, {name, front, credit, levels} = model, {values, texture} = lowered(model);
    const narrowest = Math.min(...[...values, ...(texture ? [texture] : [])].map(widest));
    const hash = new Uint8Array(await crypto.subtle?.digest("SHA-256", bytes) ?? 0);
    return {
        mplicits, target, name, front, credit, shade, shadertoy, shared, ...probes(model, 32),
        sha256: Array.from(hash, (byte) => byte.toString(16).padStart(2, "0")).join(""),
        levels: levels.map(({network}) => `${network[0].rows}x${network.length - 2}`),
        ground: Number(model.ground.toFixed(4)), storage: narrowest <= shared.storages[0][0] ? "auto" : "texture",
    };
}

// Resolves to a blob's deflate stream as text, which app/packed.html reads.
async function packed94(blob) {
    const stream = blob.stream().pipeThrough(new CompressionStream("deflate-raw"));
    const data = new Uint8Array(await new Response(stream).arrayBuffer()), digits = [];
    const padded = new DataView(new ArrayBuffer(9 * Math.ceil(data.length / 9)));
    new Uint8Array(padded.buffer).set(data);
    for (let i = 0; i < data.length; i += 9) {
        const value = (BigInt(padded.getUint8(i)) << 64n) | padded.getBigUint64(i + 1), least = 94n ** 6n;
        for (const [part, count] of [[value / least, 5], [value % least, 6]]) {
            for (let k = count - 1; k >= 0; --k) digits.push(33 + Math.floor(Number(part) / 94 ** k) % 94);
        }
    }
    const text = digits.slice(0, Math.ceil(11 * data.length / 9)).map((digit) => String.fromCharCode(digit)).join("");
    return text.replaceAll("<", " ").replace(/.{4000}/g, "$&\n");
}
