import {TrainingError} from "../kernel/training_error.js";
import {facts} from "../model/facts.js";
import {pause} from "../model/pause.js";
import {ModelError} from "../model/safetensors.js";
import {showExports} from "../save/export_buttons.js";
import {kindsOf} from "../save/export_formats.js";
import {filesOfDrop} from "../save/folder.js";
import {modelFile, trainedModel} from "../save/model_file.js";
import {provenanceOf} from "../save/provenance.js";
import {turntableVideo} from "../save/video.js";
import {groundOf} from "../shape/ground.js";
import {loadTeam} from "../train/loading.js";
import {settingsFrom, suitedSettings} from "../train/settings.js";
import {trainShape} from "../train/training.js";
import {Team} from "../train/workers.js";
import {fillChoices} from "../view/controls.js";
import {openShapesWith, refuseShape, setTitle, startParsed} from "../view/current_model.js";
import {element, fail, root, say} from "../view/messages.js";
import {center, draw, frontOfView, renderer} from "../view/view.js";
import {lacking} from "./abilities.js";
import {drawBoth, preparePreview, showPicture, showShape, turnTo} from "./picture.js";
import {follow, judged} from "./progress.js";
import {factsOfShape, state} from "./state.js";
import {forget, keep, kept} from "./storage.js";
import {LivePicture} from "./training_picture.js";

// The studio: trains a dropped shape, while the page draws its field.
const MOST_WORKERS = 16, MOST_FACES = 4e6; // faces of all workers together, since each has the shape
const LEFT_SHARE = 0.5; // of the seconds, that remains for the training after the preparation
const LONGER_FROM = 0.6; // share of the last level's schedule at which "Train longer" begins again
const hasOwnModel = root.dataset.state !== "empty"; // of `bake --studio`; its page opens without the invitation
const UPS = Object.keys(facts.studio.upright);
const NOTICED = 2500; // milliseconds
const CONTROLS = /[\p{C}\p{Zl}\p{Zp}]/gu;

let report = "", notice = ""; // the bar's line, and one that covers it for a moment

// Opens the files of a shape, and trains it. Errors of the shape become messages.
async function openShapeFiles(files) {
    const [largest] = files.filter(({name}) =>
        facts.studio.endings.some((ending) => name.toLowerCase().endsWith(ending))
    ).sort((a, b) => b.size - a.size);
    if (!largest) refuseShape(files);
    if (lacking()) throw new ModelError(lacking());
    await freeStage(largest.name);
    await guarded(async () => {
        const began = performance.now();
        const inputs = await Promise.all(files.map(async (file) => (
            {name: file.name, path: file.path ?? file.name, bytes: await file.arrayBuffer()}
        )));
        await openAndTrain({files: inputs}, largest.name, began);
    })();
}

// question: of the workers' `read`; name: of its file. began: performance.now() at the drop.
async function openAndTrain(question, name, began) {
    const settings = chosenSettings();
    if (await showShapeOf(question, name, settings)) await train(settings, null, began);
}

// Ends a training for another file, and waits for its end, where the visitor agrees to lose what is not saved. Throws
// ModelError.
async function freeStage(name) {
    const {training, shape, result} = state;
    const question = training ?
        `Stop this training and open ${name}?`
        : result && !result.isSaved
        ? `Open ${name}, without saving what is trained?`
        : "";
    if (question && !confirm(question)) throw new ModelError("not opened");
    while (state.training) {
        state.training.isStopped = state.training.isLeft = true;
        await pause(50);
    }
    if (shape) showPicture("field"); // a model may come
}

// Reads a shape and shows it. name: of its file. Returns whether it is still wanted.
async function showShapeOf(question, name, {crease = facts.studio.crease}) {
    say("");
    const size = Math.min(navigator.hardwareConcurrency || 1, MOST_WORKERS);
    const team = new Team(element("worker").textContent, size), before = state.shape;
    const mine = state.training = {};
    element("welcome").hidden = true;
    element("read").textContent = "";
    update("Reading");
    try {
        const answer = team.ask(0, "read", {...question, plain: facts.studio.plain, crease});
        preparePreview();
        const {preview, ...read} = await answer;
        before?.team.dismiss();
        team.shrink(Math.max(1, Math.floor(MOST_FACES / (read.facets ?? read).faces.length * 3)));
        const {center: middle, scale, up} = read;
        state.shape = {
            name: stem(read.name),
            center: middle,
            scale,
            up: up ?? "y",
            front: null,
            read,
            crease,
            team,
            loading: null,
        };
        state.result = null;
        setTitle(state.shape);
        center(null);
        showShape(preview);
        element("read").textContent = `Read: ${read.notes.join(" · ")}`;
    } catch (error) {
        team.dismiss();
        element("welcome").hidden = Boolean(before) || hasOwnModel;
        throw understood(error, name);
    } finally {
        state.training = null;
        update("");
    }
    return !mine.isLeft;
}

// Trains the shape. chosen: settings of settingsFrom(). start: of trainShape, or null. began: performance.now() from
// which the seconds count.
async function train(chosen, start, began) {
    const {shape} = state, {read, team} = shape, hasColors = Boolean(read.colors);
    const mine = state.training = {isPaused: false, isStopped: false, paused: 0, live: null};
    const clock = () => (performance.now() - began) / 1000 - mine.paused;
    showPicture("mesh");
    element("more").open = false;
    update("Preparing");
    await pause(0); // a task of its own
    try {
        mine.live = new LivePicture(shape, groundOf(shape), chosen, hasColors);
        mine.live.compile().catch(fail);
        const module = await loadTeam(shape);
        const settings = suitedSettings(chosen, await team.ask(0, "bend", facts.studio.config.bend));
        const end = Math.max(settings.seconds, clock() + LEFT_SHARE * settings.seconds);
        // Where the processor draws, WebGPU would be slow, and a request for it waits for the picture and blocks the page.
        const gpu = renderer.device.isSoftware ? undefined : element("step.wgsl").textContent;
        const callbacks = follow(mine, settings, clock, end, update, remember);
        const options = {module, hasColors, gpu, clock, end, start, ...callbacks};
        const trained = await trainShape(team, settings, facts.studio.config, options);
        state.result = {...trained, settings, seconds: clock(), isSaved: false};
        remember(state.result);
    } catch (error) {
        update("Not trained");
        throw understood(error, read.name);
    } finally {
        state.training = null;
        update("");
    }
    if (!mine.isLeft) await showResult();
}

// Keeps a result in the browser's storage, for a reload; the facets are quickly made again.
function remember({levels, texture, settings, seconds}) {
    const read = {...state.shape.read, facets: null};
    keep({...factsOfShape(state.shape), read, levels, texture, settings, seconds});
}

// Trains the shape on the stage anew.
async function trainAgain() {
    const settings = chosenSettings(), {read, crease, up, front} = state.shape, began = performance.now();
    const isReady = !read.facets || settings.crease === crease || await showAgain({read, settings, up, front});
    if (isReady) await train(settings, null, began);
}

// Shows a shape that was read before.
async function showAgain({read, settings, up, front}) {
    const isWanted = await showShapeOf({earlier: read}, read.name, settings);
    Object.assign(state.shape, {front});
    turnTo(up);
    return isWanted;
}

// Goes on with what a reload left.
async function resume(record) {
    const {read, settings, seconds, levels, texture} = record;
    if (!await showAgain(record)) return;
    const isWhole = levels.length === settings.levels.length && (texture || !read.colors);
    if (!isWhole)
        return train(settings, {levels, texture, weights: null, share: 0}, performance.now() - 1000 * seconds);
    state.result = {levels, texture, settings, seconds, isSaved: false};
    update("");
    return showResult();
}

// Shows the trained model, and what it can be saved as.
async function showResult() {
    const {shape, result} = state, {line, isFar} = judged(result, !shape.read.faces.length);
    Object.assign(result, {isFar, bytes: modelFile(factsOfShape(shape), result, provenanceOf(shape, result))});
    update(line);
    element("ended").textContent = line;
    element("settings")[isFar ? "prepend" : "append"](element("longer"));
    const model = {...trainedModel(factsOfShape(shape), result), ground: groundOf(shape)};
    const onSave = (id) => {
        result.isSaved ||= id === "download";
    };
    showExports(element("exports"), shape.name, kindsOf(shape, result, model, recorded), onSave, guarded);
    drawBoth();
    await startParsed(model);
    while (!renderer.seen && !renderer.device.lost) await pause(30);
    if (isCurrent(result)) showPicture("field");
}

const isCurrent = (result) => state.result === result && !state.training;

// Records a turn; the report shows the progress.
async function recorded() {
    const {result} = state, line = report;
    const video = await renderer.device.unlessLost(turntableVideo((share) => {
        update("Recording the video", share);
        return isCurrent(result) ? "" : "stop";
    }));
    if (isCurrent(result)) update(line);
    if (!video) throw new ModelError("the recording was stopped");
    return video;
}

// Trains the last level further, from its weights.
function trainLonger() {
    const {levels, texture, settings} = state.result, last = levels.at(-1);
    const isWhole = levels.length === settings.levels.length && last.share >= 1;
    const start = {
        levels: levels.slice(0, -1),
        texture,
        weights: last.weights,
        share: isWhole ? LONGER_FROM : last.share,
    };
    return train({...settings, seconds: chosenSettings().seconds}, start, performance.now());
}

async function turnUp() {
    const {shape, training, result} = state;
    turnTo(UPS[(UPS.indexOf(shape.up) + 1) % UPS.length]);
    if (training?.live) Object.assign(training.live, {shape: factsOfShape(shape), ground: groundOf(shape), drawnAt: 0});
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

const stem = (name) => name.replace(/\.\w+$/, "").replace(CONTROLS, "").slice(0, 60) || "shape";

// Returns the error for the visitor. name: of the shape's file.
const understood = (error, name) => (
    error instanceof TrainingError ? new ModelError(`${name.replace(CONTROLS, "?")}: ${error.message}`) : error
);

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
    root.toggleAttribute("data-far", Boolean(bar.hidden && result?.isFar));
    const shown = {
        picture: shape,
        up: shape,
        front: shape,
        pause: training?.live,
        stop: training?.live,
        longer: isIdle && result,
        again: isIdle,
        another: !training && (shape || hasOwnModel),
        settings: !training,
        exports: isIdle && result,
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
const guarded = (action) => () =>
    Promise.resolve().then(action).catch((error) => {
        if (error instanceof ModelError) say(error.message);
        else fail(error);
    });

function wireStudio() {
    element("welcome").hidden = hasOwnModel;
    openShapesWith(openShapeFiles, filesOfDrop, freeStage);
    element("lacking").textContent = lacking();
    element("file").multiple = true;
    const choices = Object.entries(facts.studio.presets).map(([value, {label}]) => ({value, label}));
    fillChoices(element("preset"), choices, facts.studio.preset, fillSettings);
    fillSettings(facts.studio.preset);
    element("settings").elements.crease.placeholder = facts.studio.crease;
    const buttons = {
        choose: () => element("file").click(),
        another: () => element("file").click(),
        longer: trainLonger,
        again: trainAgain,
        up: turnUp,
        front: setFront,
        pause: () => {
            state.training.isPaused = !state.training.isPaused;
            update("");
        },
        stop: () => {
            state.training.isStopped = true;
        },
    };
    for (const [id, action] of Object.entries(buttons)) element(id).addEventListener("click", guarded(action));
    for (const button of element("examples").querySelectorAll("button")) {
        const question = {example: Number(button.dataset.example)};
        button.disabled = lacking();
        button.addEventListener("click", guarded(() => openAndTrain(question, button.textContent, performance.now())));
    }
    element("settings").addEventListener("submit", (event) => event.preventDefault());
    element("more").addEventListener("keydown", ({key, currentTarget}) => {
        currentTarget.open &&= key !== "Escape";
    });
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
    button.disabled = lacking();
    button.addEventListener("click", guarded(() => resume(record)));
    element("forget").addEventListener(
        "click",
        guarded(async () => {
            await forget();
            button.parentElement.hidden = true;
        }),
    );
}

wireStudio();
