import {lowestPoint} from "../draw/lowest_point.js";
import {memoryOf} from "../draw/remembered_variant.js";
import {stepsOf} from "../draw/uniforms.js";
import {facts, shared} from "../model/facts.js";
import {ModelError, parseModel} from "../model/safetensors.js";
import {bakedScene} from "../print/baked_scene.js";
import {printField} from "../print/field.js";
import {probes} from "../print/reference.js";
import {fitsShadertoy, shadertoyText} from "../print/shadertoy.js";
import {choose, copyText, fillChoices, saveFile} from "./controls.js";
import {kindOfFile} from "./file_kinds.js";
import {compiling, element, fail, isExpected, root, say, setState, uncover} from "./messages.js";
import {afterLoss, reduced, reportLoss, reportRestored} from "./recovery.js";
import {center, draw, goTo, halt, options, renderer, set} from "./view.js";

/** @type {Current | null} The page's model or a dropped model; null in a page without a model, until a file is dropped. */
let current = null;
/** @type {Current | null} What replaces `current` when a lost context is restored. */ let next = null;
/** @type {(files: File[]) => unknown} Of files that are the input of a training. */
let openShape = (files) => refuseShape(files, WITHOUT_STUDIO);
/** @type {(transfer: DataTransfer) => File[] | Promise<File[]>} Of a drop. */ let listFiles = ({files}) => [...files];
/** @type {(name: string) => void} Throws a ModelError where the stage is in use. */ let demandIdle = () => {};
/** @type {Promise<unknown>} Of the model files so far. */ let reads = Promise.resolve();
const MODEL = /\.safetensors$/i;
const WITHOUT_STUDIO = ", or drop it on the page of: mplicits studio";

// Returns the page's own model, or null.
export function embedded() {
    const {buffer} = Uint8Array.from(atob(element("weights").textContent), (letter) => letter.charCodeAt(0));
    if (!buffer.byteLength) return null;
    const model = facts.scene ? bakedScene(facts, buffer) : parseModel(buffer, true);
    return reduced({
        model: {...model, ground: facts.ground},
        isOwn: true,
        probes: {points: facts.points, values: facts.values},
        storage: facts.storage,
        sha256: facts.sha256,
        memory: memoryOf(facts.sha256),
    });
}

/** Shows a model: fills the page, and hands the model to the renderer. @param {Current} chosen */
export async function start(chosen) {
    current = next = chosen;
    const {model} = chosen, levels = model.levels.length;
    const networks = () => model.levels.map(({network}) => `${network[0].rows}x${network.length - 2}`);
    setTitle(model);
    const size = `${model.field ? `${model.shapes} shapes` : networks().join(" > ")} · ${
        model.parameters.toLocaleString("en")
    } parameters`;
    element("shapes").textContent = model.credit ? `${size} · ${model.credit}` : size;
    element("copy").hidden = !fitsShadertoy(model);
    for (const id of ["share", "embed"]) element(id).hidden = !chosen.isOwn;
    const moves = model.inputs === "xyzt";
    element("moment").hidden = !moves;
    goTo(moves ? options.time : 0);
    const shading = options.shading === "texture" && !model.texture ? facts.shade : options.shading;
    set({level: levels, normalLevel: null, shading}, true);
    const numbers = model.levels.map((_, i) => ({value: i + 1, label: String(i + 1)}));
    fillChoices(element("level"), numbers, levels, (level) => set({level}));
    const same = {value: null, label: "same"};
    fillChoices(element("normals"), [same, ...numbers], null, (normalLevel) => set({normalLevel}));
    const choices = Object.entries(shared.shading_labels).map(([value, label]) => ({value, label}))
        .filter(({value}) => value !== "texture" || model.texture);
    fillChoices(element("shading"), choices, shading, (value) => set({shading: value}));
    showSteps();
    if (renderer.device.lost) return reportLoss(next);
    reportRestored(chosen);
    await load(chosen);
}

/** @param {{name: string}} model */
export function setTitle({name}) {
    document.title = element("name").textContent = name;
    element("shapes").textContent = "";
}

/** @param {Current} chosen */
function load({model, storage, probes: points, memory}) {
    compiling();
    draw(true);
    const {unroll} = renderer.device, literal = storage === "texture" ? null : printField(model, storage, unroll);
    return renderer.load(model, printField(model, "texture", unroll), literal, points, memory);
}

/** Shows the model in a file. For an invalid file, shows a message and keeps the old model. files: also those of a
 * shape.
 * @param {File[]} files */
export async function openFiles(files) {
    const shape = files.find(({name}) => kindOf(name)),
        file = shape ?? files.find(({name}) => MODEL.test(name)) ?? files[0];
    let isStarted = false;
    if (!file || !renderer) return; // without a renderer, a message stays
    try {
        if (shape) return await openShape(files);
        const bytes = await readInTurn(file);
        await demandIdle(file.name);
        const kind = kindOfFile(bytes);
        if (kind)
            throw new ModelError(
                `${kind}, which this page does not open. ${document.querySelector(".hint").textContent}`,
            );
        const model = parseModel(bytes);
        isStarted = true;
        await startParsed(model);
    } catch (error) {
        if (!isExpected(error)) fail(error);
        say(`${printable(file.name)}: ${/** @type {Error} */ (error).message}`);
        if (!isStarted || root.dataset.state !== "compiling") return;
        setState("drawing", "Drawing");
        draw(true);
    }
}

/** Resolves to the bytes of a file, after all files before it: the last one stays on the stage. @param {File} file */
function readInTurn(file) {
    const bytes = file.arrayBuffer().catch(() => {
        throw new ModelError("cannot be read: it is a folder, or has moved");
    });
    const turn = Promise.all([bytes, reads]).then(([own]) => own);
    reads = turn.catch(() => {});
    return turn;
}

/** Opens what was dropped. transfer: of the event. @param {DataTransfer} transfer */
export async function openDropped(transfer) {
    await openFiles(await listFiles(transfer));
}

/** Shows a model of parseModel, which may have a `ground`: the height of its lowest point.
 * @param {Model & {ground?: number}} model */
export async function startParsed(model) {
    renderer.device.check(printField(model, "texture").height);
    say("");
    leave();
    goTo(0);
    center(model.front);
    element("poster").hidden = true;
    const grounded = {...model, ground: model.ground ?? lowestPoint(model)};
    await start({model: grounded, probes: probes(model), storage: "texture", sha256: "", memory: memoryOf("")});
}

/** Calls `open` with dropped files that are the input of a training, and `demand` before a dropped model is shown.
 * Errors of both become messages. list: returns the files of a drop, from the event's transfer.
 * @param {typeof openShape} open @param {typeof listFiles} list
 * @param {typeof demandIdle} demand */
export function openShapesWith(open, list, demand) {
    openShape = open;
    listFiles = list;
    demandIdle = demand;
}

const kindOf = (/** @type {string} */ name) => shared.shapes[name.toLowerCase().match(/\.\w+$/)?.[0] ?? ""];

/** Throws a ModelError for files that are the input of a training. more: end of the message for a mesh.
 * @param {File[]} files */
export function refuseShape(files, more = "") {
    const {name} = /** @type {File} */ (files.find((file) => kindOf(file.name)));
    const kind = kindOf(name), end = kind.startsWith("a mesh") ? more : "";
    throw new ModelError(`${kind}; train it with: mplicits train ${quoted(printable(name))}${end}`);
}

/** Returns a file's name with unprintable characters escaped. @param {string} name */
const printable = (name) =>
    name.replace(/[\p{C}\p{Zl}\p{Zp}]/gu, (c) => `\\u{${Number(c.codePointAt(0)).toString(16)}}`);

/** Quotes a file's name for a shell, as shape_hint in model/checks.py. @param {string} name */
function quoted(name) {
    const path = name.startsWith("-") ? `./${name}` : name;
    return /^[\w@%+=:,./-]+$/.test(path) ? path : `'${path.replaceAll("'", `'"'"'`)}'`;
}

export function showSteps() {
    if (!current) return;
    const steps = stepsOf(current.model, options);
    element("steps").textContent = steps.join(" · ");
    element("iterations").setAttribute("aria-valuetext", `${steps.join(", ")} steps`);
}

/** @param {string} shading */
export function shade(shading) {
    if (shading === "texture" && !current?.model.texture) return;
    choose(element("shading"), shading);
    uncover();
    set({shading});
}

/** @param {number} level */
export function goToLevel(level) {
    if (!current || level > current.model.levels.length) return;
    choose(element("level"), level);
    choose(element("normals"), null);
    uncover();
    set({level, normalLevel: null});
}

export async function save() {
    if (!current) return;
    element("save").disabled = true;
    halt();
    try {
        saveFile(await renderer.png(), current.model.name, "png");
    } catch (error) {
        if (!isExpected(error)) throw error; // else the lost context has its message
    } finally {
        element("save").disabled = false;
    }
}

export async function copy() {
    if (current) await copyShadertoy(shadertoyText(current.model, current.sha256));
}

/** Copies a text for Shadertoy, or the text of a promise, and says what to do with it.
 * @param {string | Promise<string>} text */
export async function copyShadertoy(text) {
    await copyText(text);
    say("Copied. On shadertoy.com: New, paste over the text in the Image tab, press play.");
}

// Forgets a trial of literals that the visitor ended by leaving: the literals have not failed.
export function leave() {
    current?.memory.interrupted(null);
}

/** @param {Event} event */
export function contextLost(event) {
    event.preventDefault();
    if (!current) return;
    next = afterLoss(current, renderer.variants.current);
    reportLoss(next);
}

export function contextRestored() {
    restore().catch(fail);
}

async function restore() {
    renderer.open();
    if (!next) return;
    if (next !== current) return start(next);
    reportRestored(next);
    return load(next);
}
