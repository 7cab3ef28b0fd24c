import {fromHash, homeOf, orbited, panned, toHash, zoomed} from "./camera.js";
import {facts, shared} from "./facts.js";
import {drawing, element, listener, root, uncover} from "./messages.js";
import {Renderer} from "./renderer.js";

// What is seen: a camera, which is kept in the URL's hash, and options. The renderer is told whenever one changes.
// options: level, normalLevel (null: the same), shading (a name), iterations (a factor on the model's own), resolution
// ("auto", or pixels drawn per pixel of the canvas along each axis), time, light (camera space), and background, which
// is [bottom, top].
export const canvas = element("view");
const NO_STEPS = [0.01, 0.01, 0.05]; // heat(0) in glsl/heat.glsl
const {light} = shared.defaults;
export const options = {
    level: 1, normalLevel: null, shading: "phong", iterations: 1, resolution: "auto", time: 0,
    light: light.map((c) => c / Math.hypot(...light)), background: [],
};
export let renderer = null;
let home = homeOf(facts.front), camera = fromHash(location.hash, home), naming = 0;

export function openRenderer() {
    const sources = ["prologue", "main", "accumulate", "present"].map((id) => [id, element(id).textContent]);
    renderer = new Renderer(canvas, Object.fromEntries(sources), listener);
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
    camera = next;
    uncover();
    draw(true);
    clearTimeout(naming);
    naming = setTimeout(() => history.replaceState(null, "", toHash(camera)), 250);
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
    camera = fromHash(location.hash, home);
    uncover();
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
