import {HOME, fromHash, orbited, panned, toHash, zoomed} from "./camera.js";
import {choose, copyText, fillChoices, lightBall, listenToDrops} from "./controls.js";
import {DeviceError} from "./device.js";
import {listenToHands, listenToKeys} from "./gestures.js";
import {printField} from "./field.js";
import {probes} from "./reference.js";
import {Renderer} from "./renderer.js";
import {ModelError, parseModel} from "./safetensors.js";

const element = (id) => document.getElementById(id);
const source = (id) => element(id).textContent;
const root = document.documentElement, canvas = element("view");
const facts = JSON.parse(source("model"));

const BACKGROUNDS = {
    slate: {tone: "dark", bottom: facts.defaults.background_bottom, top: facts.defaults.background_top},
    night: {tone: "dark", bottom: [0.02, 0.02, 0.03], top: [0.07, 0.08, 0.11]},
    paper: {tone: "light", bottom: [0.85, 0.84, 0.81], top: [0.97, 0.965, 0.95]},
    sky: {tone: "light", bottom: [0.80, 0.85, 0.88], top: [0.55, 0.69, 0.80]},
};
const css = (colour) => `rgb(${colour.map((c) => Math.round(255 * c)).join(" ")})`;
const length = Math.hypot(...facts.defaults.light);
const options = {
    level: 1, normalLevel: null, shading: "phong", iterations: 1, resolution: "auto", time: 0,
    light: facts.defaults.light.map((c) => c / length), background: [],
};
let camera = fromHash(location.hash), renderer = null, shown = null;

// The embedded model, as a dropped one would come; storage: how its other variant stores weights, if there is one.
function embedded() {
    const bytes = Uint8Array.from(atob(source("weights")), (letter) => letter.charCodeAt(0));
    return {
        model: parseModel(bytes.buffer, true), probes: {points: facts.points, values: facts.values},
        storage: facts.storage, shadertoy: facts.shadertoy, memory: memoryOf(facts.sha256),
    };
}

// Which variant an earlier visit found to be the faster one; "trying" where it never came to an answer.
function memoryOf(hash) {
    const key = `mplicits ${hash}`;
    let last = null;
    return {
        read() {
            try {
                return localStorage.getItem(key);
            } catch {
                return last;
            }
        },
        write(storage) {
            last = storage;
            try {
                if (storage) localStorage.setItem(key, storage);
                else localStorage.removeItem(key);
            } catch { /* a browser that keeps nothing */ }
        },
    };
}

function say(text, closable = true) {
    const box = element("message");
    box.querySelector("p").textContent = text;
    box.querySelector("button").hidden = !closable;
    box.hidden = !text;
}

function fail(error) {
    const expected = error instanceof DeviceError || error instanceof ModelError;
    say(expected ? error.message : `This page came upon something it does not know: ${error.message}`, expected);
    root.dataset.state = "failed";
    if (!expected) throw error;
}

// Shows a model in the page and hands it to the renderer.
async function start(next) {
    shown = next;
    const {model} = next, levels = model.levels.length;
    const shapes = model.levels.map(({network}) => `${network[0].rows}x${network.length - 2}`);
    document.title = element("name").textContent = model.name;
    element("facts").textContent = `${shapes.join(" > ")} · ${model.parameters.toLocaleString("en")} parameters`;
    element("copy").hidden = !next.shadertoy;
    element("moment").hidden = model.inputs !== "xyzt";
    Object.assign(options, {level: levels, normalLevel: null});
    if (options.shading === "texture" && !model.texture) options.shading = "phong";
    const numbers = shapes.map((_, i) => ({value: i + 1, label: String(i + 1)}));
    fillChoices(element("level"), numbers, levels, (level) => set({level}));
    fillChoices(element("normals"), [{value: null, label: "same"}, ...numbers], null, (normalLevel) => set({normalLevel}));
    const shadings = {phong: "Phong", normal: "Normals", depth: "Depth", steps: "Steps", ...(model.texture ? {texture: "Texture"} : {})};
    const choices = Object.entries(shadings).map(([value, label]) => ({value, label}));
    fillChoices(element("shading"), choices, options.shading, (shading) => set({shading}));
    showSteps();
    await load(next);
}

function load({model, storage, probes: points, memory}) {
    draw(true);
    const literal = storage === "texture" ? null : printField(model, storage);
    return renderer.load(model, printField(model, "texture"), literal, points, memory);
}

// Takes another model in; whatever is wrong with it is said in one line, and what was there stays.
async function take(file) {
    if (!file) return;
    try {
        const model = parseModel(await file.arrayBuffer());
        renderer.device.check(printField(model, "texture").height, model.levels.length);
        say("");
        await start({model, probes: probes(model), storage: "texture", shadertoy: null, memory: memoryOf("")});
    } catch (error) {
        if (error instanceof ModelError || error instanceof DeviceError) say(`${file.name}: ${error.message}`);
        else renderer.lostOr(error);
    }
}

function set(change, moving = false) {
    Object.assign(options, change);
    if (renderer) draw(moving);
}

function draw(moving) {
    root.dataset.state = "drawing";
    renderer.show(camera, {...options}, moving);
}

let saying = 0;
function move(next) {
    camera = next;
    draw(true);
    clearTimeout(saying);
    saying = setTimeout(() => history.replaceState(null, "", toHash(camera)), 250);
}

function reset() {
    move({...HOME, target: [...HOME.target]});
}

function showSteps() {
    const steps = shown.model.levels.map((level) => Math.max(1, Math.round(level.iterations * options.iterations)));
    element("steps").textContent = steps.join(" · ");
}

function setBackground(name) {
    const {tone, bottom, top} = BACKGROUNDS[name];
    root.dataset.tone = tone;
    set({background: [bottom, top]});
}

function fold(folded) {
    element("side").classList.toggle("folded", folded);
    root.classList.toggle("unfolded", !folded);
    element("fold").setAttribute("aria-expanded", String(!folded));
}

async function save() {
    element("save").disabled = true;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(await renderer.png());
    link.download = `${shown.model.name.replace(/[^\p{L}\p{N}_-]+/gu, "-").slice(0, 60)}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    element("save").disabled = false;
}

function fullScreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else root.requestFullscreen().catch(() => say("This browser does not let the page fill the screen."));
}

const status = {time: "", field: ""};
const listener = {
    frame({milliseconds, size, samples, settled}) {
        const time = milliseconds < 10 ? `${milliseconds.toFixed(1)} ms`
            : milliseconds < 1000 ? `${Math.round(milliseconds)} ms` : `${(milliseconds / 1000).toFixed(1)} s`;
        status.time = `${time} · ${size[0]} × ${size[1]}${samples > 1 ? ` · ${samples} samples` : ""}`;
        element("status").textContent = `${status.time}\n${status.field}`;
        if (settled) root.dataset.state = "still";
    },
    stored(storage, error) {
        root.dataset.storage = storage;
        const off = error === null ? "field error not measurable here" : `field error ${error.toExponential(1)}`;
        status.field = `${off} · weights as ${storage === "literal" ? "literals" : "a texture"}`;
        if (error !== null) root.dataset.error = String(error);
    },
    failed: fail,
};

function aspect() {
    return canvas.width / canvas.height;
}

function resize() {
    const scale = Math.min(devicePixelRatio || 1, 8192 / Math.max(canvas.clientWidth, canvas.clientHeight, 1));
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(1, Math.round(side * scale)));
    if (width === canvas.width && height === canvas.height) return;
    Object.assign(canvas, {width, height});
    if (renderer) renderer.resized();
    if (shown) draw(true);
}

function wire() {
    const swatches = Object.entries(BACKGROUNDS).map(([value, {bottom, top}]) => (
        {value, label: value, paint: `linear-gradient(${css(top)}, ${css(bottom)})`}));
    const first = matchMedia("(prefers-color-scheme: light)").matches ? "paper" : "slate";
    fillChoices(element("background"), swatches, first, setBackground);
    setBackground(first);
    const scales = [{value: "auto", label: "Auto"}, {value: 1, label: "1"}, {value: 0.5, label: "½"}, {value: 0.25, label: "¼"}];
    fillChoices(element("resolution"), scales, "auto", (resolution) => set({resolution}));
    lightBall(element("light"), options.light, (light) => set({light}, true));
    element("iterations").addEventListener("input", (event) => {
        set({iterations: 2 ** Number(event.target.value)}, true);
        showSteps();
    });
    element("time").addEventListener("input", (event) => {
        set({time: Number(event.target.value)}, true);
        element("instant").textContent = event.target.value;
    });
    element("fold").addEventListener("click", () => fold(!element("side").classList.contains("folded")));
    element("save").addEventListener("click", save);
    element("full").addEventListener("click", fullScreen);
    element("reset").addEventListener("click", reset);
    element("open").addEventListener("click", () => element("file").click());
    element("file").addEventListener("change", (event) => {
        take(event.target.files[0]);
        event.target.value = "";
    });
    element("copy").addEventListener("click", async () => {
        await copyText(shown.shadertoy);
        say("Copied. On shadertoy.com: New, paste over the text in the Image tab, press play.");
    });
    element("panel").addEventListener("submit", (event) => event.preventDefault());
    element("message").querySelector("button").addEventListener("click", () => say(""));
    listenToDrops(element("drop"), take);
    const turn = (right, up) => move(orbited(camera, -180 * right, -180 * up));
    const pan = (right, up) => move(panned(camera, -right, -up, aspect()));
    const zoom = (factor) => move(zoomed(camera, factor, aspect()));
    listenToHands(canvas, {turn, pan, zoom, reset});
    const arrow = (right, up) => (event) => (event.shiftKey ? pan(-0.05 * right, -0.05 * up) : turn(-right / 36, -up / 36));
    const shade = (shading) => () => {
        if (shading === "texture" && !shown.model.texture) return;
        choose(element("shading"), shading);
        set({shading});
    };
    const level = (value) => () => {
        if (value > shown.model.levels.length) return;
        choose(element("level"), value);
        choose(element("normals"), null);
        set({level: value, normalLevel: null});
    };
    listenToKeys({
        ArrowLeft: arrow(-1, 0), ArrowRight: arrow(1, 0), ArrowUp: arrow(0, 1), ArrowDown: arrow(0, -1),
        "+": () => zoom(0.9), "=": () => zoom(0.9), "-": () => zoom(1 / 0.9), r: reset, s: save, f: fullScreen,
        h: () => element("fold").click(), Escape: () => say(""),
        p: shade("phong"), n: shade("normal"), d: shade("depth"), x: shade("steps"), t: shade("texture"),
        ...Object.fromEntries(Array.from({length: 9}, (_, i) => [i + 1, level(i + 1)])),
    });
    addEventListener("hashchange", () => {
        camera = fromHash(location.hash);
        draw(true);
    });
    // Whoever leaves while the literals compile has not seen them fail.
    addEventListener("pagehide", () => {
        if (shown.memory.read() === "trying") shown.memory.write(null);
    });
    canvas.addEventListener("webglcontextlost", (event) => {
        event.preventDefault();
        if (shown.memory.read() === "trying") shown.memory.write("texture");
        root.dataset.state = "lost";
        say("The graphics driver was reset. The picture comes back when the driver does; if not, reload the page.", false);
    });
    canvas.addEventListener("webglcontextrestored", () => {
        say("");
        renderer.open();
        load(shown).catch((error) => renderer.lostOr(error));
    });
    new ResizeObserver(resize).observe(canvas);
}

async function main() {
    fold(innerWidth <= 600);
    resize();
    const sources = Object.fromEntries(["prologue", "main", "accumulate", "present"].map((id) => [id, source(id)]));
    shown = embedded();
    element("name").textContent = document.title = shown.model.name;
    renderer = new Renderer(canvas, sources, facts.defaults, listener);
    wire();
    await start(shown);
}

main().catch((error) => (renderer ? renderer.lostOr(error) : fail(error)));
