import {BACKGROUNDS, plainBackground} from "../draw/backgrounds.js";
import {fillChoices, lightBall, listenToDrops} from "./controls.js";
import {watchDensity} from "../draw/device.js";
import {shared} from "../model/facts.js";
import {backgroundName, hasView, listenToHost, tellHost, turnTime} from "./embedding.js";
import {listenToKeys, listenToPointers} from "./gestures.js";
import {dismiss, element, fail, root, say, uncover} from "./messages.js";
import {
    contextLost,
    contextRestored,
    copy,
    embedded,
    goToLevel,
    leave,
    openDropped,
    openFiles,
    save,
    setTitle,
    shade,
    showSteps,
    start,
} from "./current_model.js";
import {share} from "./share.js";
import {
    canvas,
    css,
    followHash,
    openRenderer,
    options,
    pan,
    place,
    play,
    reset,
    resize,
    seek,
    set,
    turn,
    turntable,
    zoom,
} from "./view.js";

/** Connects the controls to the view. @param {string} name */
function setBackground(name) {
    const {tone, bottom, top} = BACKGROUNDS[name] ?? plainBackground(name);
    root.dataset.tone = tone;
    set({background: [bottom, top]});
}

/** @param {boolean} folded */
function fold(folded) {
    root.classList.toggle("unfolded", !folded);
    element("fold").setAttribute("aria-expanded", String(!folded));
}

function fullScreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else root.requestFullscreen().catch(() => say("This browser does not let the page fill the screen."));
}

function wirePanel() {
    const swatches = Object.entries(BACKGROUNDS).map(([value, {bottom, top}]) => (
        {value, label: value, paint: `linear-gradient(${css(top)}, ${css(bottom)})`}
    ));
    const usual = root.dataset.tone === "light" ? "paper" : "slate";
    const isKnown = Object.hasOwn(BACKGROUNDS, backgroundName) || plainBackground(backgroundName);
    const first = isKnown ? backgroundName : usual;
    fillChoices(element("background"), swatches, first, setBackground);
    setBackground(first);
    const scales = /** @type {[Options["resolution"], string][]} */ (
        [["auto", "Auto"], [1, "1"], [0.5, "½"], [0.25, "¼"]]
    ).map(([value, label]) => ({value, label}));
    fillChoices(element("resolution"), scales, "auto", (resolution) => set({resolution}));
    lightBall(element("light"), options.light, (light) => set({light}, true));
    element("iterations").addEventListener("input", ({target}) => {
        set({iterations: 2 ** Number(/** @type {HTMLInputElement} */ (target).value)}, true);
        showSteps();
    });
    element("time").addEventListener("input", ({target}) => (
        seek(Number(/** @type {HTMLInputElement} */ (target).value))
    ));
    element("panel").addEventListener("input", uncover, {capture: true});
    element("panel").addEventListener("submit", (event) => event.preventDefault());
}

function wireButtons() {
    const buttons = {
        fold: () => fold(root.classList.contains("unfolded")),
        play,
        save,
        full: fullScreen,
        reset,
        open: () => element("file").click(),
        share: () => share(false),
        embed: () => share(true),
        copy,
    };
    for (const [id, action] of Object.entries(buttons)) element(id).addEventListener("click", action);
    element("message").querySelector("button").addEventListener("click", dismiss);
    element("file").addEventListener("change", ({target}) => {
        const input = /** @type {HTMLInputElement & {files: FileList}} */ (target);
        openFiles([...input.files]);
        input.value = "";
    });
    listenToDrops(element("drop"), openDropped);
}

function wireGestures() {
    listenToPointers(canvas, {turn, pan, zoom, reset});
    /** @type {(right: number, up: number) => (event: KeyboardEvent) => void} */
    const arrow = (right, up) => ({shiftKey}) => (
        shiftKey ? pan(-0.05 * right, -0.05 * up) : turn(-right / 36, -up / 36)
    );
    const levels = Array.from({length: 9}, (_, i) => [i + 1, () => goToLevel(i + 1)]);
    listenToKeys({
        ArrowLeft: arrow(-1, 0),
        ArrowRight: arrow(1, 0),
        ArrowUp: arrow(0, 1),
        ArrowDown: arrow(0, -1),
        "+": () => zoom(0.9),
        "=": () => zoom(0.9),
        "-": () => zoom(1 / 0.9),
        r: reset,
        s: save,
        f: fullScreen,
        " ": () => element("moment").hidden || play(),
        h: () => element("fold").click(),
        Escape: dismiss,
        ...Object.fromEntries(levels),
        ...Object.fromEntries(Object.entries(shared.shading_keys).map(([key, shading]) => [key, () => shade(shading)])),
    });
}

function wireWindow() {
    addEventListener("hashchange", followHash);
    addEventListener("pagehide", leave);
    canvas.addEventListener("webglcontextlost", contextLost);
    canvas.addEventListener("webglcontextrestored", contextRestored);
    new ResizeObserver(resize).observe(canvas);
    watchDensity(resize);
    listenToHost(({level, time, ...camera}) => {
        if (Object.keys(camera).length) place(camera);
        if (level) goToLevel(level);
        if (time !== undefined && !element("moment").hidden) seek(time);
    });
}

async function main() {
    const own = embedded();
    if (own) setTitle(own.model);
    for (const wire of [wirePanel, wireButtons, wireGestures, wireWindow]) wire();
    fold(!root.classList.contains("unfolded"));
    openRenderer();
    if (hasView) element("poster").hidden = true; // it shows the first view
    resize();
    root.dataset.ready = "";
    if (turnTime) turntable(turnTime);
    if (!own) return;
    const started = start(own), {levels, inputs} = own.model;
    tellHost("ready", {levels: levels.length, moves: inputs === "xyzt"});
    await started;
}

main().catch(fail);
