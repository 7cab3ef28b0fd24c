import {fillChoices} from "./controls.js";
import {openShapesWith, refuseShape, setTitle, startParsed} from "./current_model.js";
import {pause} from "./device.js";
import {showExports} from "./exports.js";
import {facts} from "./facts.js";
import {filesOfDrop} from "./folder.js";
import {kindsOf, modelOf} from "./kinds.js";
import {LivePicture} from "./live.js";
import {loadTeam} from "./loading.js";
import {element, fail, root, say} from "./messages.js";
import {modelFile} from "./model_file.js";
import {groundOfShape, preparePreview, showPicture, showShape, turnTo} from "./picture.js";
import {provenanceOf} from "./provenance.js";
import {ModelError} from "./safetensors.js";
import {settingsFrom, suitedSettings} from "./settings.js";
import {factsOfShape, state} from "./state.js";
import {forget, keep, kept} from "./storage.js";
import {Team} from "./team.js";
import {trainShape} from "./training.js";
import {TrainingError} from "./training_error.js";
import {turntableVideo} from "./video.js";
import {center, draw, drawWith, frontOfView, renderer} from "./view.js";

// The studio: trains a dropped shape, while the page draws its field.
const MOST_WORKERS = 16, MOST_FACES = 4e6; // faces of all workers together, since each has the shape
const BETWEEN_PICTURES = 1000, BETWEEN_REPORTS = 200; // milliseconds
const PICTURES_SHARE = 0.2; // largest share of the time that pictures may take
const LEFT_SHARE = 0.5; // of the seconds, that remains for the training after the preparation
const LONGER_FROM = 0.6; // share of the last level's schedule at which "Train longer" begins again
const hasOwnModel = root.dataset.state !== "empty"; // of `bake --studio`; its page opens without the invitation
const UPS = Object.keys(facts.studio.upright);
const READABLE = /\.(obj|ply|stl|glb|gltf|xyz)$/i;
const NOTICED = 2500; // milliseconds

let report = "", notice = ""; // the bar's line, and one that covers it for a moment

// Opens the files of a shape, and trains it.
async function openShapeFiles(files) {
    if (!files.some(({name}) => READABLE.test(name))) refuseShape(files);
    const began = performance.now();
    const inputs = await Promise.all(files.map(async (file) => (
        {name: file.name, path: file.path ?? file.name, bytes: await file.arrayBuffer()})));
    await openAndTrain({files: inputs}, began);
}

// question: of the workers' `read`. began: performance.now() at the drop.
async function openAndTrain(question, began) {
    const settings = chosenSettings();
    await showShapeOf(question, settings);
    await train(settings, null, began);
}

// Throws a ModelError while a shape is read or trained.
function demandStage() {
    const {training} = state;
    if (training) throw new ModelError(training.live ? "stop the training first" : "wait until the first shape is read");
}

// Reads a shape and shows it.
async function showShapeOf(question, {crease = facts.studio.crease}) {
    demandStage();
    say("");
    const size = Math.min(navigator.hardwareConcurrency || 1, MOST_WORKERS);
    const team = new Team(element("worker").textContent, size), before = state.shape;
    state.training = {};
    element("welcome").hidden = true;
    update("Reading");
    try {
        const answer = team.ask(0, "read", {...question, plain: facts.studio.plain, crease});
        preparePreview();
        const {preview, ...read} = await answer;
        before?.team.dismiss();
        team.shrink(Math.max(1, Math.floor(MOST_FACES / (read.facets ?? read).faces.length * 3)));
        const {center: middle, scale, up} = read, name = stem(read.name);
        state.shape = {name, center: middle, scale, up: up ?? "y", front: null, read, crease, team, loading: null};
        state.result = null;
        setTitle(state.shape);
        center(null);
        showShape(preview);
    } catch (error) {
        team.dismiss();
        element("welcome").hidden = Boolean(before) || hasOwnModel;
        throw understood(error);
    } finally {
        state.training = null;
        update("");
    }
}

// Trains the shape. chosen: settings of settingsFrom(). start: of trainShape, or null. began: performance.now() from
// which the seconds count.
async function train(chosen, start, began) {
    demandStage();
    const {shape} = state, {read, team} = shape, hasColors = Boolean(read.colors);
    const mine = state.training = {isPaused: false, isStopped: false, paused: 0, live: null};
    const clock = () => (performance.now() - began) / 1000 - mine.paused;
    showPicture("mesh");
    update(`Preparing ${read.notes.join(" · ")}`);
    await pause(0); // a task of its own
    try {
        mine.live = new LivePicture(shape, groundOfShape(), chosen, hasColors);
        mine.live.compile().catch(fail);
        const module = await loadTeam(shape);
        const settings = suitedSettings(chosen, await team.ask(0, "bend", facts.studio.config.bend));
        const end = Math.max(settings.seconds, clock() + LEFT_SHARE * settings.seconds);
        const afterStep = follow(mine, settings, clock, end);
        // Where the processor draws, WebGPU would be slow, and a request for it waits for the picture and blocks the page.
        const gpu = renderer.device.isSoftware ? undefined : element("step.wgsl").textContent;
        const options = {module, hasColors, gpu, clock, end, start, afterStep};
        const trained = await trainShape(team, settings, facts.studio.config, options);
        state.result = {...trained, settings, seconds: clock(), isSaved: false};
        remember(state.result);
    } catch (error) {
        update("Not trained");
        throw understood(error);
    } finally {
        state.training = null;
        update("");
    }
    await showResult();
}

// Returns afterStep for trainShape: it draws, reports, keeps what is finished, and waits during a pause.
function follow(mine, settings, clock, end) {
    const {live} = mine, names = [...settings.levels.map((_, i) => `Level ${i + 1} of ${settings.levels.length}`), "Colors"];
    let reportedAt = 0, isSeen = false, finished = 0;
    return async ({stage, done, meanF, levels, network, layout, weights}) => {
        const now = performance.now();
        if (now > reportedAt + BETWEEN_REPORTS) {
            const accuracy = stage < settings.levels.length ? meanF : levels.at(-1).meanF;
            const left = settings.steps ? clock() / done * (1 - done) : end - clock();
            update(`${names[stage]} · mean |f| ${accuracy.toExponential(1)} · ${Math.max(0, Math.ceil(left))} s left`, done);
            reportedAt = now;
        }
        if (levels.length > finished) {
            finished = levels.length;
            remember({levels: [...levels], texture: null, settings, seconds: clock()});
        }
        const wait = Math.max(BETWEEN_PICTURES, (renderer.refining?.frame ?? 0) / PICTURES_SHARE);
        if (live.isReady && now > live.drawnAt + wait && !document.hidden) {
            if (!isSeen) drawWith(null);
            await live.show({levels, unfinished: {network, layout, weights}});
        }
        if (!isSeen && renderer.quicked >= live.since) {
            showPicture("field");
            isSeen = true;
        }
        while (mine.isPaused && !mine.isStopped) {
            const since = performance.now();
            await pause(50);
            mine.paused += (performance.now() - since) / 1000;
        }
        return mine.isStopped ? "stop" : "";
    };
}

// Keeps a result in the browser's storage, for a reload; the facets are quickly made again.
function remember({levels, texture, settings, seconds}) {
    const read = {...state.shape.read, facets: null};
    keep({...factsOfShape(state.shape), read, levels, texture, settings, seconds});
}

// Trains the shape on the stage anew.
async function trainAgain() {
    const settings = chosenSettings(), {read, crease, up, front} = state.shape, began = performance.now();
    if (read.facets && settings.crease !== crease) await showAgain({read, settings, up, front});
    await train(settings, null, began);
}

// Shows a shape that was read before.
async function showAgain({read, settings, up, front}) {
    await showShapeOf({earlier: read}, settings);
    Object.assign(state.shape, {front});
    turnTo(up);
}

// Goes on with what a reload left.
async function resume(record) {
    const {read, settings, seconds, levels, texture} = record;
    await showAgain(record);
    const isWhole = levels.length === settings.levels.length && (texture || !read.colors);
    if (!isWhole) return train(settings, {levels, texture, weights: null, share: 0}, performance.now() - 1000 * seconds);
    state.result = {levels, texture, settings, seconds, isSaved: false};
    update("");
    return showResult();
}

// Shows the trained model, and what it can be saved as.
async function showResult() {
    const {shape, result} = state, {meanF, distance = meanF, angle} = result.levels.at(-1);
    result.bytes = modelFile(factsOfShape(shape), result, provenanceOf(shape, result));
    const figures = `off by ${distance.toExponential(1)} of the radius · normals by ${angle.toFixed(1)}°`;
    update(`Trained in ${Math.round(result.seconds)} s · ${figures}`);
    element("ended").textContent = element("report").textContent;
    const onSave = (id) => { result.isSaved ||= id === "download"; };
    showExports(element("exports"), shape.name, kindsOf(shape, result, recorded), onSave, guarded);
    showPicture("field");
    await startParsed(modelOf(result));
}

// Records a turn; the report shows the progress.
async function recorded() {
    const {result} = state, line = report, isCurrent = () => state.result === result && !state.training;
    const video = await renderer.device.unlessLost(turntableVideo((share) => {
        update("Recording the video", share);
        return isCurrent() ? "" : "stop";
    }));
    if (isCurrent()) update(line);
    if (!video) throw new ModelError("the recording was stopped");
    return video;
}

// Trains the last level further, from its weights.
function trainLonger() {
    const {levels, texture, settings} = state.result, last = levels.at(-1);
    const isWhole = levels.length === settings.levels.length && last.share >= 1;
    const start = {levels: levels.slice(0, -1), texture, weights: last.weights, share: isWhole ? LONGER_FROM : last.share};
    return train({...settings, seconds: chosenSettings().seconds}, start, performance.now());
}

async function turnUp() {
    const {shape, training, result} = state;
    turnTo(UPS[(UPS.indexOf(shape.up) + 1) % UPS.length]);
    if (training?.live) Object.assign(training.live, {shape: factsOfShape(shape), ground: groundOfShape(), drawnAt: 0});
    if (result && !training) await showResult();
    else draw(false);
}

// Makes the present view the one on which the model opens.
async function setFront() {
    center(state.shape.front = frontOfView());
    notify("Front set. The model opens on this view");
    setTimeout(notify, NOTICED, "");
    if (state.result && !state.training) await showResult();
}

function notify(text) {
    element("ended").textContent = notice = text;
    update("");
}

const stem = (name) => name.replace(/\.\w+$/, "").replace(/[\p{C}\p{Zl}\p{Zp}]/gu, "").slice(0, 60) || "shape";
const understood = (error) => (error instanceof TrainingError ? new ModelError(error.message) : error);

// Shows a line, and a bar unless share is null; and the buttons of this moment. line: "" keeps the one before.
function update(line, share = null) {
    const {shape, training, result} = state, bar = element("trained"), isIdle = shape && !training;
    if (line) {
        report = line;
        bar.value = share; // null is 0: a bar of an unknown share would move, and drawing that slows the training down
    }
    element("report").textContent = notice || report;
    element("report").parentElement.hidden = !shape && !training;
    bar.hidden = share === null && !training;
    const shown = {
        picture: shape, up: shape, front: shape, pause: training?.live, stop: training?.live, longer: isIdle && result,
        again: isIdle, another: !training && (shape || hasOwnModel), settings: !training, exports: isIdle && result,
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

// Returns an action of a button that shows its errors.
const guarded = (action) => () => Promise.resolve().then(action).catch((error) => {
    if (error instanceof ModelError) say(error.message);
    else fail(error);
});

function wireStudio() {
    element("welcome").hidden = hasOwnModel;
    openShapesWith(openShapeFiles, filesOfDrop, demandStage);
    element("file").multiple = true;
    const choices = Object.entries(facts.studio.presets).map(([value, {label}]) => ({value, label}));
    fillChoices(element("preset"), choices, facts.studio.preset, fillSettings);
    fillSettings(facts.studio.preset);
    element("settings").elements.crease.placeholder = facts.studio.crease;
    const buttons = {
        choose: () => element("file").click(), another: () => element("file").click(), longer: trainLonger,
        again: trainAgain, up: turnUp, front: setFront,
        pause: () => {
            state.training.isPaused = !state.training.isPaused;
            update("");
        },
        stop: () => { state.training.isStopped = true; },
    };
    for (const [id, action] of Object.entries(buttons)) element(id).addEventListener("click", guarded(action));
    for (const button of element("examples").querySelectorAll("button")) {
        const question = {example: Number(button.dataset.example)};
        button.addEventListener("click", guarded(() => openAndTrain(question, performance.now())));
    }
    element("settings").addEventListener("submit", (event) => event.preventDefault());
    element("more").addEventListener("keydown", ({key, currentTarget}) => { currentTarget.open &&= key !== "Escape"; });
    addEventListener("beforeunload", (event) => {
        if (state.training || (state.result && !state.result.isSaved)) event.preventDefault();
    });
    update("");
    offerKept().catch(fail);
}

// Offers what the last visit left.
async function offerKept() {
    const record = await kept(), button = element("resume");
    if (!record) return;
    button.textContent = `Go on with ${record.name}`;
    button.parentElement.hidden = false;
    button.addEventListener("click", guarded(() => resume(record)));
    element("forget").addEventListener("click", guarded(async () => {
        await forget();
        button.parentElement.hidden = true;
    }));
}

wireStudio();
