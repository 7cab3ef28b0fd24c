import {facts, shared} from "../model/facts.js";
import {packed124} from "./page_export.js";

// Writes the tiny page of a model, as web/tiny_page.py does, but with the networks as text of the shader.

/** Resolves to the HTML. @param {Model} model @param {string} shadertoy its text, of shadertoyText (shadertoy.js) */
export async function tinyText({name, credit, front, inputs}, shadertoy) {
    const {head, main, camera, dropped, script, page, unpacker} = facts.studio.tiny;
    let shader = shadertoy.replace(new RegExp(dropped, "gm"), "");
    for (const [text, replacement] of Object.entries(camera)) shader = shader.replace(text, replacement);
    const {azimuth, elevation} = shared.camera;
    /** @type {Record<string, unknown>} */
    const values = {
        NETWORKS: [],
        VIEW: (front ?? [azimuth, elevation]).map((angle) => Number((angle * Math.PI / 180).toFixed(3))),
        MOVES: Number(inputs === "xyzt"),
        SHADER: head + shader + main,
    };
    const filled = script.replace(
        new RegExp(`\\b(${Object.keys(values).join("|")})\\b`, "g"),
        (key) => JSON.stringify(values[key]),
    );
    /** @type {Record<string, string>} */
    const slots = {
        title: escapedHtml(name),
        label: escapedHtml(credit ? `${name} by ${credit}` : name),
        packed: await packed124(new Blob([filled, "\0"])),
        scripts: crypto.subtle ? `${unpacker} ${await policySource(filled)}` : "'unsafe-inline'",
    };
    return page.replace(/\{\{(\w+)\}\}/g, (_, key) => slots[key]);
}

/** Returns text for HTML, in printable ASCII. @param {string} text */
const escapedHtml = (text) =>
    text.replace(/\p{C}/gu, "").replace(/[^ -~]|[&<>]/gu, (letter) => `&#${letter.codePointAt(0)};`);

/** Resolves to the source of a policy that allows a script (web/policy.py). @param {string} script */
async function policySource(script) {
    const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", new TextEncoder().encode(script)));
    return `'sha256-${btoa(String.fromCharCode(...digest))}'`;
}
