import {Axes} from "./axes.js";
import {fillChoices} from "./controls.js";
import {openShapesWith, refuseShape, setTitle, startParsed} from "./current_model.js";
import {pause} from "./device.js";
import {showExports} from "./exports.js";
import {facts} from "./facts.js";
import {filesOfDrop} from "./folder.js";
import {LivePicture} from "./live.js";
import {element, fail, root, say, setState, uncover} from "./messages.js";
import {modelFile} from "./model_file.js";
import {functionText} from "./glsl_function.js";
import {hashOf} from "./header.js";
import {turned} from "./orientation.js";
import {canWritePage, pageText} from "./page_export.js";
import {posterOf} from "./poster.js";
import {Preview} from "./preview.js";
import {ModelError, parseModel} from "./safetensors.js";
import {settingsFrom} from "./settings.js";
import {shadertoyText} from "./shadertoy.js";
import {Team} from "./team.js";
import {trainShape} from "./training.js";
import {TrainingError} from "./training_error.js";
import {turntableVideo} from "./video.js";
import {center, draw, drawWith, frontOfView, renderer} from "./view.js";

// The studio: trains a dropped shape, while the page draws its field.
const MOST_WORKERS = 16;
const BETWEEN_PICTURES = 1000, BETWEEN_REPORTS = 200; // milliseconds
const PICTURES_SHARE = 0.2; // largest share of the time that pictures may take
const LEFT_SHARE = 0.5; // of the seconds, that remains for the training after the preparation
const LONGER_FROM = 0.6; // share of the last level's schedule at which "Train longer" begins again
const MESH_CELLS = 256; // along an edge of the grid of an exported mesh
const UPS = Object.keys(facts.studio.upright);
const READABLE = /\.(obj|ply|stl|glb|gltf|xyz)$/i;

// The shape on the stage: {name, center, scale, up, front, read, ground, hasColors, team}; or null.
let shape = null;
// The training under way: {isPaused, isStopped, seconds (without pauses)}; or null. The result of the last one:
// {levels, texture, settings, seconds, bytes, isSaved}; or null.
let training = null, result = null;
let preview = null, axes = null;

// Reads a shape, shows it, and trains it. files: File objects.
async function open(files) {
    if (training) throw new ModelError("stop the training first");
    const name = files.find(({name: one}) => READABLE.test(one))?.name;
    if (!name) refuseShape(files);
    const began = performance.now();
    const inputs = await Promise.all(files.map(async (file) => (
        {name: file.name, path: file.path ?? file.name, bytes: await file.arrayBuffer()})));
    return begin({files: inputs}, began);
}

// question: of the workers' `read`. began: performance.now() at the drop.
async function begin(question, began) {
    if (training) throw new ModelError("stop the training first");
    const settings = chosenSettings();
    say("");
    closeShape();
    training = {isPaused: false, isStopped: false};
    element("welcome").hidden = true;
    update("Reading");
    const team = new Team(element("worker").textContent, Math.min(navigator.hardwareConcurrency || 1, MOST_WORKERS));
    try {
        const {preview: corners, ...read} = await team.ask(0, "read", {...question, plain: facts.studio.plain});
        shape = {
            name: stem(read.name), center: read.center, scale: read.scale, up: read.up ?? "y", front: null, read, team,
            hasColors: Boolean(read.colors), isLoaded: false, positions: corners.positions,
        };
        preview ??= new Preview(element("mesh"), (name) => renderer.painter.shader(name));
        preview.load(corners);
        turnTo(shape.up);
        setTitle(shape);
        center(null);
        showPicture("mesh");
        await train(settings, null, began);
    } catch (error) {
        training = null;
        if (!shape) {
            team.dismiss();
            element("welcome").hidden = false;
        }
        update("");
        throw understood(error);
    }
}

// Trains the shape. start: of trainShape, or null. began: performance.now() from which the seconds count.
async function train(settings, start, began) {
    const mine = training = {isPaused: false, isStopped: false, paused: 0}, {team} = shape;
    const clock = () => (performance.now() - began) / 1000 - mine.paused;
    try {
        update(`Preparing ${shape.read.notes.join(" · ")}`);
        const live = new LivePicture(shape, lowest(turned(shape.positions, shape.up)), settings, shape.hasColors);
        mine.live = live;
        live.compile().catch(fail);
        if (!shape.isLoaded) {
            const module = await WebAssembly.compile(bytesOf(element("kernel").textContent));
            await team.all("load", () => ({module, read: shape.read}));
            shape.isLoaded = true;
        }
        const end = Math.max(settings.seconds, clock() + LEFT_SHARE * settings.seconds);
        const trained = await trainShape(team, settings, facts.studio.config, {
            hasColors: shape.hasColors, clock, end, start, afterStep: follow(mine, live, settings, clock, end),
        });
        result = {...trained, settings, seconds: clock()};
    } catch (error) {
        throw understood(error);
    } finally {
        training = null;
        update("");
    }
    await showResult();
}

// Returns afterStep for trainShape: it draws, reports, and waits during a pause.
function follow(mine, live, settings, clock, end) {
    const names = [...settings.levels.map((_, i) => `Level ${i + 1} of ${settings.levels.length}`), "Colors"];
    let reportedAt = 0;
    return async ({stage, done, meanF, levels, network, layout, weights}) => {
        const now = performance.now();
        if (now > reportedAt + BETWEEN_REPORTS) {
            const accuracy = stage < settings.levels.length ? meanF : levels.at(-1).meanF;
            const left = settings.steps ? clock() / done * (1 - done) : end - clock();
            update(`${names[stage]} · mean |f| ${accuracy.toExponential(1)} · ${Math.max(0, Math.ceil(left))} s left`, done);
            reportedAt = now;
        }
        const wait = Math.max(BETWEEN_PICTURES, (renderer.refining?.frame ?? 0) / PICTURES_SHARE);
        if (live.isReady && now > live.drawnAt + wait && !document.hidden) {
            await live.show({levels, unfinished: {network, layout, weights}});
            if (!mine.isSeen) showPicture("field");
            mine.isSeen = true;
        }
        while (mine.isPaused && !mine.isStopped) {
            const since = performance.now();
            await pause(50);
            mine.paused += (performance.now() - since) / 1000;
        }
        return mine.isStopped ? "stop" : "";
    };
}

// Shows the trained model, and offers its file.
async function showResult() {
    result.bytes = modelFile(shape, result, provenance());
    const {meanF, angle} = result.levels.at(-1);
    update(`Trained in ${Math.round(result.seconds)} s · mean |f| ${meanF.toExponential(1)} of the radius · normals off by ${angle.toFixed(1)}°`);
    showExports(element("exports"), shape.name, kinds(), (id) => { result.isSaved ||= id === "download"; }, guarded);
    showPicture("field");
    await startParsed(modelOf(result));
}

// Returns what the trained shape can be saved as (exports.js).
function kinds() {
    const model = modelOf(result), hash = hashOf(result.bytes.buffer);
    let text = null;
    const shadertoy = async () => (text ??= shadertoyText(model, await hash));
    const inWorker = (format) => async () => {
        const [levels, texture] = [result.levels, result.texture && [result.texture]].map((networks) => (
            networks?.map(({network, weights, delta}) => ({network, weights, delta}))));
        const place = {center: shape.center, scale: shape.scale};
        const question = {format, levels, texture: texture?.[0] ?? null, resolution: MESH_CELLS, place};
        return (await shape.team.ask(0, "mesh", question)).bytes;
    };
    return [
        {id: "download", label: "Model", title: "For mplicits and for this page", ending: "safetensors", make: () => result.bytes, isQuick: true},
        {id: "copy-text", label: "Copy Shadertoy", title: "Text for the Image tab of shadertoy.com", make: shadertoy, isCopied: true},
        {id: "save-page", label: "Web page", title: "One file that shows the shape anywhere", ending: "html", make: async () => (
            pageText(result.bytes, facts.shade, await shadertoy().catch(() => null), await posterOf(renderer, facts.shade)))},
        {id: "save-text", label: "Shadertoy", title: "The same text as a file", ending: "frag", make: shadertoy, isQuick: true},
        {id: "save-glsl", label: "GLSL", title: "Functions of the field for your shader", ending: "glsl", make: async () => functionText(model, await hash), isQuick: true},
        {id: "save-ply", label: "PLY", title: "A mesh of the field", ending: "ply", make: inWorker("ply")},
        {id: "save-glb", label: "GLB", title: "A mesh of the field", ending: "glb", make: inWorker("glb")},
        {id: "save-webm", label: "Video", title: "One turn, as WebM", ending: "webm", make: recorded},
    ].filter(({id}) => canWritePage || id !== "save-page");
}

// Records a turn; the report shows the progress.
async function recorded() {
    const video = await turntableVideo((share) => {
        update("Recording the video", share);
        return result && !training ? "" : "stop";
    });
    update(video ? "Recorded" : "");
    if (!video) throw new ModelError("the recording was stopped");
    return video;
}

const modelOf = ({bytes}) => ({...parseModel(bytes.buffer), ground: lowest(turned(shape.positions, shape.up))});

// The record of the training, with the keys of `mplicits train`.
function provenance() {
    const {settings, seconds} = result;
    const recordOf = ({layout: {width, depth}, steps, share, restarts, loss, seconds: spent}, omega) => (
        {network: `${width}x${depth}`, omega, steps, fraction: share, restarts, loss, seconds: Number(spent.toFixed(3))});
    return {
        made_by: "page", source: {file: shape.read.name}, seed: settings.seed, seconds: Number(seconds.toFixed(3)),
        levels: result.levels.map((level, i) => (
            {...recordOf(level, settings.omegas[i]), mean_f: level.meanF, angle: level.angle})),
        texture: result.texture && recordOf(result.texture, settings.omegas.at(-1)),
    };
}

// Trains the last level further, from its weights.
function trainLonger() {
    const {levels, texture, settings} = result, isWhole = levels.length === settings.levels.length && levels.at(-1).share >= 1;
    const {weights, share} = levels.at(-1), start = {
        levels: levels.slice(0, -1), texture, weights, share: isWhole ? LONGER_FROM : share,
    };
    return train({...settings, seconds: chosenSettings().seconds}, start, performance.now());
}

function closeShape() {
    shape?.team.dismiss();
    shape = result = null;
    drawWith(null);
    for (const id of ["mesh", "axes"]) element(id).toggleAttribute("hidden", true);
    delete root.dataset.preview;
}

// Shows the "mesh" or the "field".
function showPicture(which) {
    const isMesh = which === "mesh";
    for (const id of ["mesh", "axes"]) element(id).toggleAttribute("hidden", !isMesh);
    root.toggleAttribute("data-preview", isMesh);
    if (isMesh) {
        element("poster").hidden = true;
        root.dataset.drawn = "";
        setState("still", "");
    }
    drawWith(isMesh ? {show: (camera, options) => {
        preview.show(camera, options);
        axes.show(camera);
    }} : null);
    const choices = [{value: "mesh", label: "Mesh"}, {value: "field", label: "Field"}];
    fillChoices(element("picture"), choices, which, showPicture);
}

// Turns the shape so that an axis of the file points up.
function turnTo(up) {
    shape.up = preview.up = axes.up = up;
    element("up").textContent = `Up: ${up.toUpperCase().replace("-", "−")}`;
}

async function turnUp() {
    turnTo(UPS[(UPS.indexOf(shape.up) + 1) % UPS.length]);
    if (training?.live) Object.assign(training.live, {ground: lowest(turned(shape.positions, shape.up)), drawnAt: 0});
    if (result && !training) await showResult();
    else draw(false);
}

// Makes the present view the one on which the model opens.
async function setFront() {
    shape.front = frontOfView();
    if (result && !training) await showResult();
}

function lowest(positions) {
    let y = Infinity;
    for (let i = 1; i < positions.length; i += 3) y = Math.min(y, positions[i]);
    return y;
}

const stem = (name) => name.replace(/\.\w+$/, "").replace(/[\p{C}\p{Zl}\p{Zp}]/gu, "").slice(0, 60) || "shape";
const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
const understood = (error) => (error instanceof TrainingError ? new ModelError(error.message) : error);

// Shows a line, and a bar unless share is null; and the buttons of this moment.
function update(line, share = null) {
    const bar = element("trained"), isIdle = shape && !training;
    if (line) element("report").textContent = line;
    element("report").parentElement.hidden = !shape && !training;
    bar.hidden = share === null;
    bar.value = share ?? 0;
    const shown = {
        picture: shape, up: shape, front: shape, pause: training?.live, stop: training?.live, longer: isIdle && result,
        again: isIdle, another: isIdle, settings: !training, exports: isIdle && result,
    };
    for (const [id, isShown] of Object.entries(shown)) element(id).hidden = !isShown;
    element("pause").textContent = training?.isPaused ? "Go on" : "Pause";
}

function chosenSettings() {
    const form = element("settings"), preset = form.querySelector("input[name=preset]:checked").value;
    return facts.studio.fixed ?? settingsFrom(preset, Object.fromEntries(new FormData(form)));
}

function fillSettings(preset) {
    const {levels, seconds} = facts.studio.presets[preset];
    Object.assign(element("settings").elements.levels, {value: levels});
    Object.assign(element("settings").elements.seconds, {value: String(seconds)});
}

// Calls an action of a button, and shows its errors.
const guarded = (action) => () => Promise.resolve().then(action).catch((error) => {
    if (error instanceof ModelError) say(error.message);
    else fail(error);
});

function wireStudio() {
    axes = new Axes(element("axes"));
    openShapesWith(open, filesOfDrop);
    element("file").multiple = true;
    const choices = Object.entries(facts.studio.presets).map(([value, {label}]) => ({value, label}));
    fillChoices(element("preset"), choices, facts.studio.preset, fillSettings);
    fillSettings(facts.studio.preset);
    const buttons = {
        choose: () => element("file").click(), another: () => element("file").click(), longer: trainLonger,
        again: () => train(chosenSettings(), null, performance.now()), up: turnUp, front: setFront,
        pause: () => {
            training.isPaused = !training.isPaused;
            update("");
        },
        stop: () => { training.isStopped = true; },
    };
    for (const [id, action] of Object.entries(buttons)) element(id).addEventListener("click", guarded(action));
    for (const button of element("examples").querySelectorAll("button")) {
        button.addEventListener("click", guarded(() => begin({example: Number(button.dataset.example)}, performance.now())));
    }
    element("settings").addEventListener("submit", (event) => event.preventDefault());
    addEventListener("beforeunload", (event) => {
        if (training || (result && !result.isSaved)) event.preventDefault();
    });
    update("");
}

wireStudio();
