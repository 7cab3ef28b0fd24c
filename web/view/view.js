import {FOCAL, fromHash, homeOf, matrix, orbited, panned, toHash, zoomed} from "../draw/camera.js";
import {nextFrame} from "../draw/device.js";
import {Renderer} from "../draw/renderer.js";
import {nearAngle} from "../draw/reprojection.js";
import {facts, shared} from "../model/facts.js";
import {keptInHash, tellHost} from "./embedding.js";
import {drawing, element, listener, root, uncover} from "./messages.js";

// The view: camera and options, which the renderer gets after every change. The URL's hash stores the camera and the
// time of a motion.
export const canvas = element("view");
const NO_STEPS = [0.01, 0.01, 0.05]; // heat(0) in glsl/functions/heat.glsl
const {light} = shared.defaults;
/** @type {Options} */
export const options = {
    level: 1,
    normalLevel: null,
    shading: facts.shade,
    iterations: 1,
    resolution: "auto",
    time: timeFrom(location.hash),
    light: light.map((c) => c / Math.hypot(...light)),
    background: [],
};
/** @type {Renderer} */
export let renderer; // not defined where the browser cannot draw
/** @type {Drawer | null} */ let drawer = null; // draws in place of the renderer

/** Returns the time in a hash, or 0. @param {string} hash */
function timeFrom(hash) {
    const time = Number(new URLSearchParams(hash.slice(1)).get("t"));
    return time >= 0 && time <= 1 ? time : 0;
}

let home = homeOf(facts.front), camera = fromHash(location.hash, home), hashTimer = 0;
let phase = 0; // of the motion, from 0 to 1
/** @type {object | null} */ let playing = null; // what a run of play() has set
let isTurning = false;

export function openRenderer() {
    renderer = new Renderer(canvas, (id) => element(id).textContent, listener);
}

/** Draws. moving: coarse pixels suffice for now. @param {boolean} moving */
export function draw(moving) {
    if (!renderer) return;
    if (!drawer) drawing();
    if (!("drawn" in root.dataset)) tiltPoster();
    (drawer ?? renderer).show(camera, {...options}, moving);
}

// Turns the poster like a card, and moves and scales it: it stands in for the view until a frame is drawn.
function tiltPoster() {
    const ratio = aspect(), [far, near] = [home, camera].map((each) => zoomed(each, 1, ratio).distance);
    const m = matrix(camera, ratio), pixels = canvas.clientHeight * FOCAL / 2;
    const shift = (/** @type {number} */ k) =>
        m.slice(k, k + 3).reduce((sum, c, i) => sum - c * camera.target[i], 0) * pixels / near;
    const right = home.azimuth - nearAngle(camera.azimuth, home.azimuth);
    const up = home.elevation - nearAngle(camera.elevation, home.elevation);
    element("poster").style.transform =
        `translate(${shift(0)}px, ${-shift(4)}px) scale(${far / near}) perspective(${pixels}px) `
        + `rotateX(${up}deg) rotateY(${right}deg)`;
}

/** Lets another object draw, with the method `show` of a renderer, or with null the renderer again.
 * @param {Drawer | null} other */
export function drawWith(other) {
    if (other === drawer) return;
    drawer = other;
    draw(false);
}

/** @param {Partial<Options>} change */
export function set(change, moving = false) {
    Object.assign(options, change);
    paintStage();
    draw(moving);
}

/** @param {Vector} color */
export const css = (color) => `rgb(${color.map((c) => Math.round(255 * c)).join(" ")})`;

// Paints the background behind the canvas and the text, as the shader does.
function paintStage() {
    const stage = element("stage"), isHeat = options.shading === "steps";
    const [bottom, top] = (isHeat ? [NO_STEPS, NO_STEPS] : options.background).map(css);
    stage.dataset.tone = isHeat ? "dark" : root.dataset.tone;
    stage.style.setProperty("--bottom", bottom);
    stage.style.setProperty("--top", top);
}

/** @param {Camera} next */
function look(next) {
    isTurning = false;
    camera = next;
    uncover();
    draw(true);
    writeHash();
}

/** @param {Camera} next */
function move(next) {
    look(next);
    tellCamera();
}

function tellCamera() {
    tellHost("camera", {...camera, distance: zoomed(camera, 1, aspect()).distance, target: [...camera.target]});
}

/** Sets some of the camera's numbers for the host, which is not told of them. @param {Partial<Camera>} change */
export const place = (change) => look({...camera, ...change});

// Writes camera and time to the URL's hash, after a delay.
function writeHash() {
    clearTimeout(hashTimer);
    const time = () => (options.time ? `&t=${Number(options.time.toFixed(3))}` : "");
    hashTimer = setTimeout(() => history.replaceState(null, "", toHash(camera) + time() + keptInHash), 250);
}

/** @param {number} time */
function showTime(time) {
    element("time").value = String(time);
    element("instant").textContent = time.toFixed(2);
    set({time}, true);
}

/** Stops at a time from 0 to 1. @param {number} time */
export function goTo(time) {
    halt();
    phase = Math.acos(1 - 2 * time) / (2 * Math.PI);
    showTime(time);
}

/** The visitor sets the time. @param {number} time */
export function seek(time) {
    uncover();
    goTo(time);
    writeHash();
}

export function halt() {
    playing = null;
    delete root.dataset.playing;
    element("play").querySelector("span").textContent = "Play";
}

// Plays the motion back and forth until halt(); halts if it already plays.
export async function play() {
    if (playing) {
        halt();
        return writeHash();
    }
    const mine = playing = {};
    root.dataset.playing = "";
    element("play").querySelector("span").textContent = "Pause";
    uncover();
    for (let last = performance.now();;) {
        await nextFrame();
        if (playing !== mine) return;
        const now = performance.now();
        phase = (phase + Math.min(now - last, 250) / 1000 / shared.period) % 1;
        last = now;
        showTime(0.5 - 0.5 * Math.cos(2 * Math.PI * phase));
    }
}

/** Turns the shape on a turntable until the visitor moves it. @param {number} seconds */
export async function turntable(seconds) {
    isTurning = true;
    for (let last = performance.now();;) {
        await nextFrame();
        if (!isTurning) return;
        const now = performance.now();
        if (renderer && "drawn" in root.dataset && !renderer.saving) {
            camera = orbited(camera, 360 * Math.min(now - last, 250) / 1000 / seconds, 0);
            draw(true);
            tellCamera();
        }
        last = now;
    }
}

/** Returns the camera after a turn, in degrees. @param {number} degrees */
export const viewTurned = (degrees) => orbited(camera, degrees, 0);

// Gestures, in shares of the canvas's height to the right and up.
const aspect = () => canvas.width / canvas.height;
/** @param {number} right @param {number} up */
export const turn = (right, up) => move(orbited(camera, -180 * right, -180 * up));
/** @param {number} right @param {number} up */
export const pan = (right, up) => move(panned(camera, -right, -up, aspect()));
/** @param {number} factor */
export const zoom = (factor) => move(zoomed(camera, factor, aspect()));
export const reset = () => move(home);

// Returns the front that the camera looks at: [azimuth, elevation], degrees.
export const frontOfView = () => [camera.azimuth, camera.elevation].map((angle) => Number(angle.toFixed(1)));

/** Centers another model: from its front, or from the current direction. @param {number[] | null} front */
export function center(front) {
    home = homeOf(front);
    move(front ? home : {...camera, distance: home.distance, target: home.target});
}

/** newURL: of the event; writeHash() may have replaced the page's own meanwhile. @param {{newURL: string}} event */
export function followHash({newURL}) {
    const {hash} = new URL(newURL);
    isTurning = false;
    camera = fromHash(hash, home);
    uncover();
    goTo(element("moment").hidden ? 0 : timeFrom(hash));
    if (location.hash !== hash) writeHash();
}

export function resize() {
    const scale = Math.min(devicePixelRatio || 1, 8192 / Math.max(canvas.clientWidth, canvas.clientHeight, 1));
    const pixels = (/** @type {number} */ side) => Math.max(1, Math.round(side * scale));
    const width = pixels(canvas.clientWidth), height = pixels(canvas.clientHeight);
    if (width === canvas.width && height === canvas.height) return;
    Object.assign(canvas, {width, height});
    renderer?.resized();
    draw(true);
}
