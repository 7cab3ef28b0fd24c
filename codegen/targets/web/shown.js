import {choose, copyText, fillChoices} from "./controls.js";
import {facts, shared} from "./facts.js";
import {printField} from "./field.js";
import {memoryOf} from "./memory.js";
import {element, fail, isExpected, root, say} from "./messages.js";
import {probes} from "./reference.js";
import {parseModel} from "./safetensors.js";
import {stepsOf} from "./uniforms.js";
import {draw, options, renderer, set} from "./view.js";

// The model that is shown, the page's own or one that was dropped: {model, probes, storage, shadertoy, memory}.
// storage: how its second variant stores weights; "texture": it has none. shadertoy: the text to copy, or null.
let shown = null;
const SHADING_LABELS = {phong: "Phong", normal: "Normals", depth: "Depth", steps: "Steps", texture: "Texture"};

// Returns the page's own model.
export function embedded() {
    const bytes = Uint8Array.from(atob(element("weights").textContent), (letter) => letter.charCodeAt(0));
    return {
        model: parseModel(bytes.buffer, true), probes: {points: facts.points, values: facts.values},
        storage: facts.storage, shadertoy: facts.shadertoy, memory: memoryOf(facts.sha256),
    };
}

// Shows a model: fills the page with what it has, and hands it to the renderer.
export async function start(next) {
    shown = next;
    const {model} = next, levels = model.levels.length;
    const shapes = model.levels.map(({network}) => `${network[0].rows}x${network.length - 2}`);
    entitle(model);
    element("shapes").textContent = `${shapes.join(" > ")} · ${model.parameters.toLocaleString("en")} parameters`;
    element("copy").hidden = !next.shadertoy;
    element("moment").hidden = model.inputs !== "xyzt";
    Object.assign(options, {level: levels, normalLevel: null});
    if (options.shading === "texture" && !model.texture) options.shading = "phong";
    const numbers = shapes.map((_, i) => ({value: i + 1, label: String(i + 1)}));
    fillChoices(element("level"), numbers, levels, (level) => set({level}));
    const same = {value: null, label: "same"};
    fillChoices(element("normals"), [same, ...numbers], null, (normalLevel) => set({normalLevel}));
    const possible = shared.shadings.filter((name) => name in SHADING_LABELS && (name !== "texture" || model.texture));
    const choices = possible.map((value) => ({value, label: SHADING_LABELS[value]}));
    fillChoices(element("shading"), choices, options.shading, (shading) => set({shading}));
    showSteps();
    await load();
}

export function entitle({name}) {
    document.title = element("name").textContent = name;
}

function load() {
    const {model, storage, probes: points, memory} = shown;
    draw(true);
    const literal = storage === "texture" ? null : printField(model, storage);
    return renderer.load(model, printField(model, "texture"), literal, points, memory);
}

// Shows the model in a file. Where something is wrong with it, a message says so and the old model stays.
export async function take(file) {
    if (!file) return;
    try {
        const model = parseModel(await file.arrayBuffer());
        renderer.device.check(printField(model, "texture").height, model.levels.length);
        say("");
        leave();
        await start({model, probes: probes(model), storage: "texture", shadertoy: null, memory: memoryOf("")});
    } catch (error) {
        if (isExpected(error)) say(`${file.name}: ${error.message}`);
        else fail(error);
    }
}

export function showSteps() {
    element("steps").textContent = stepsOf(shown.model, options).join(" · ");
}

export function shade(shading) {
    if (shading === "texture" && !shown.model.texture) return;
    choose(element("shading"), shading);
    set({shading});
}

export function goToLevel(level) {
    if (level > shown.model.levels.length) return;
    choose(element("level"), level);
    choose(element("normals"), null);
    set({level, normalLevel: null});
}

export async function save() {
    element("save").disabled = true;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(await renderer.png());
    link.download = `${shown.model.name.replace(/[^\p{L}\p{N}_-]+/gu, "-").slice(0, 60)}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    element("save").disabled = false;
}

export async function copy() {
    await copyText(shown.shadertoy);
    say("Copied. On shadertoy.com: New, paste over the text in the Image tab, press play.");
}

// Forgets a trial of literals that the visitor ended by going elsewhere: the literals have not failed. Where the
// context was lost meanwhile, they have.
export function leave() {
    shown.memory.interrupted(null);
}

export function contextLost(event) {
    event.preventDefault();
    shown.memory.interrupted("texture");
    root.dataset.state = "lost";
    say("The graphics driver was reset. The picture comes back when the driver does; if not, reload the page.", false);
}

export function contextRestored() {
    say("");
    renderer.open();
    load().catch(fail);
}
