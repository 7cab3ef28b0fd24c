import {HOME, fromHash, orbited, panned, toHash, zoomed} from "./camera.js";
import {element, listener, root} from "./messages.js";
import {Renderer} from "./renderer.js";

// What is seen: a camera, which is the URL's hash, and options, given to the renderer whenever one of them changes.
export const canvas = element("view"), facts = JSON.parse(element("model").textContent);
const {light} = facts.defaults;
export const options = {
    level: 1, normalLevel: null, shading: "phong", iterations: 1, resolution: "auto", time: 0,
    light: light.map((c) => c / Math.hypot(...light)), background: [],
};
export let renderer = null;
let camera = fromHash(location.hash), naming = 0;

export function openRenderer() {
    const sources = ["prologue", "main", "accumulate", "present"].map((id) => [id, element(id).textContent]);
    renderer = new Renderer(canvas, Object.fromEntries(sources), facts.defaults, listener);
}

// moving: coarse pixels will do until it rests.
export function draw(moving) {
    root.dataset.state = "drawing";
    renderer.show(camera, {...options}, moving);
}

export function set(change, moving = false) {
    Object.assign(options, change);
    draw(moving);
}

function move(next) {
    camera = next;
    draw(true);
    clearTimeout(naming);
    naming = setTimeout(() => history.replaceState(null, "", toHash(camera)), 250);
}

// Shares of the canvas's height to the right and up, as gestures.js has them.
const aspect = () => canvas.width / canvas.height;
export const turn = (right, up) => move(orbited(camera, -180 * right, -180 * up));
export const pan = (right, up) => move(panned(camera, -right, -up, aspect()));
export const zoom = (factor) => move(zoomed(camera, factor, aspect()));
export const reset = () => move(HOME);

export function followHash() {
    camera = fromHash(location.hash);
    draw(true);
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
