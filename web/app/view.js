import {fromHash, homeOf, orbited, panned, toHash, zoomed} from "./camera.js";
import {keptInHash} from "./embedding.js";
import {facts, shared} from "./facts.js";
import {nextFrame} from "./device.js";
import {drawing, element, listener, root, uncover} from "./messages.js";
import {Renderer} from "./renderer.js";

// What is seen: a camera and options. The renderer is told whenever one changes. The camera, and the time of a motion, are
// kept in the URL's hash.
// options: level, normalLevel (null: the same), shading (a name), iterations (a factor on the model's own), resolution
// ("auto", or pixels drawn per pixel of the canvas along each axis), time, light (camera space), and background, which
// is [bottom, top].
export const canvas = element("view");
const NO_STEPS = [0.01, 0.01, 0.05]; // heat(0) in glsl/heat.glsl
const {light} = shared.defaults;
export const options = {
    level: 1, normalLevel: null, shading: facts.shade, iterations: 1, resolution: "auto", time: timeFrom(location.hash),
    light: light.map((c) => c / Math.hypot(...light)), background: [],
};
export let renderer = null;

// Returns the time of a motion that a hash names; 0 where it names none.
function timeFrom(hash) {
    const time = Number(new URLSearchParams(hash.slice(1)).get("t"));
    return time >= 0 && time <= 1 ? time : 0;
}

let home = homeOf(facts.front), camera = fromHash(location.hash, home), naming = 0;
let phase = 0, isPlaying = false; // the share of the motion's way there and back
let isTurning = false;

export function openRenderer() {
    renderer = new Renderer(canvas, (id) => element(id).textContent, listener);
}

// Has the renderer draw. moving: coarse pixels will do until it rests.
export function draw(moving) {
    drawing();
    renderer.show(camera, {...options}, moving);
}

// Changes options, and draws.
export function set(change, moving = false) {
    Object.assign(options, change);
    paintStage();
    draw(moving);
}

export const css = (colour) => `rgb(${colour.map((c) => Math.round(255 * c)).join(" ")})`;

// Paints what is behind the canvas, until the first draw, and under the text as the shader paints the background.
function paintStage() {
    const stage = element("stage"), isHeat = options.shading === "steps";
    const [bottom, top] = (isHeat ? [NO_STEPS, NO_STEPS] : options.background).map(css);
    stage.dataset.tone = isHeat ? "dark" : root.dataset.tone;
    stage.style.setProperty("--bottom", bottom);
    stage.style.setProperty("--top", top);
}

function move(next) {
    isTurning = false;
    camera = next;
    uncover();
    draw(true);
    nameView();
}

// Writes camera and time into the URL's hash, soon.
function nameView() {
    clearTimeout(naming);
    const time = () => (options.time ? `&t=${Number(options.time.toFixed(3))}` : "");
    naming = setTimeout(() => history.replaceState(null, "", toHash(camera) + time() + keptInHash), 250);
}

// Shows a time from 0 to 1 of the motion.
function showTime(time) {
    element("time").value = String(time);
    element("instant").textContent = time.toFixed(2);
    set({time}, true);
}

// Shows a time, and stays there.
export function goTo(time) {
    halt();
    phase = Math.acos(1 - 2 * time) / (2 * Math.PI);
    showTime(time);
}

// Does so for the visitor.
export function seek(time) {
    uncover();
    goTo(time);
    nameView();
}

export function halt() {
    isPlaying = false;
    delete root.dataset.playing;
    element("play").querySelector("span").textContent = "Play";
}

// Moves the shape there and back, slower at both ends, until halt(); halts where it moves. Motion is drawn as
// coarsely as it has to be, as while one turns the shape, and refined where it stops.
export async function play() {
    if (isPlaying) {
        halt();
        return nameView();
    }
    isPlaying = true;
    root.dataset.playing = "";
    element("play").querySelector("span").textContent = "Pause";
    uncover();
    for (let last = performance.now(); ;) {
        await nextFrame();
        if (!isPlaying) return;
        const now = performance.now();
        phase = (phase + Math.min(now - last, 250) / 1000 / shared.period) % 1;
        last = now;
        showTime(0.5 - 0.5 * Math.cos(2 * Math.PI * phase));
    }
}

// Turns the shape as on a turntable, once in so many seconds, until somebody moves it.
export async function turntable(seconds) {
    isTurning = true;
    for (let last = performance.now(); ;) {
        await nextFrame();
        if (!isTurning) return;
        const now = performance.now();
        if (renderer && "drawn" in root.dataset) {
            camera = orbited(camera, 360 * Math.min(now - last, 250) / 1000 / seconds, 0);
            draw(true);
        }
        last = now;
    }
}

// What hands do, in shares of the canvas's height to the right and up, as gestures.js counts them.
const aspect = () => canvas.width / canvas.height;
export const turn = (right, up) => move(orbited(camera, -180 * right, -180 * up));
export const pan = (right, up) => move(panned(camera, -right, -up, aspect()));
export const zoom = (factor) => move(zoomed(camera, factor, aspect()));
export const reset = () => move(home);

// Puts another shape into the middle, whole: seen from the front that its model names, or else turned as this one is.
export function centre(front) {
    home = homeOf(front);
    move(front ? home : {...camera, distance: home.distance, target: home.target});
}

export function followHash() {
    isTurning = false;
    camera = fromHash(location.hash, home);
    uncover();
    goTo(element("moment").hidden ? 0 : timeFrom(location.hash));
}

export function resize() {
    const scale = Math.min(devicePixelRatio || 1, 8192 / Math.max(canvas.clientWidth, canvas.clientHeight, 1));
    const pixels = (side) => Math.max(1, Math.round(side * scale));
    const width = pixels(canvas.clientWidth), height = pixels(canvas.clientHeight);
    if (width === canvas.width && height === canvas.height) return;
    Object.assign(canvas, {width, height});
    renderer.resized();
    draw(true);
}
