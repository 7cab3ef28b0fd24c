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
/** @import {Start} from "../train/training.js" */
/** @import {Question} from "../train/workers.js" */
/** @import {FullState, Result, Training} from "./state.js" */
/** @import {Kept} from "./storage.js" */

// The studio: trains a dropped shape, while the page draws its field.
const MOST_WORKERS = 16, MOST_FACES = 4e6; // faces of all workers together, since each has the shape
const LEFT_SHARE = 0.5; // of the seconds, that remains for the training after the preparation
const LONGER_FROM = 0.6; // share of the last level's schedule at which "Train longer" begins again
const hasOwnModel = root.dataset.state !== "empty"; // of `bake --studio`; its page opens without the invitation
const UPS = /** @type {Up[]} */ (Object.keys(facts.studio.upright));
const NOTICED = 2500; // milliseconds
const CONTROLS = /[\p{C}\p{Zl}\p{Zp}]/gu;
const inputs = /** @type {Record<string, HTMLInputElement>} */ (/** @type {unknown} */ (element("settings").elements));

let report = "", notice = ""; // the bar's line, and one that covers it for a moment

/** Opens the files of a shape, and trains it. Errors of the shape become messages.
 * @param {(File & {path?: string})[]} files */
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

/** @param {Partial<Question<"read">>} question @param {string} name of its file
 * @param {number} began performance.now() at the drop */
async function openAndTrain(question, name, began) {
    const settings = chosenSettings();
    if (await showShapeOf(question, name, settings)) await train(settings, null, began);
}

/** Ends a training for another file, and waits for its end, where the visitor agrees to lose what is not saved. Throws
 * ModelError. @param {string} name */
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

/** Reads a shape and shows it. Returns whether it is still wanted.
 * @param {Partial<Question<"read">>} question @param {string} name of its file @param {Partial<Settings>} settings */
async function showShapeOf(question, name, {crease = facts.studio.crease}) {
    say("");
    const size = Math.min(navigator.hardwareConcurrency || 1, MOST_WORKERS);
    const team = new Team(element("worker").textContent, size), before = state.shape;
    /** @type {Partial<Training>} */
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

/** Trains the shape. @param {Settings} chosen @param {Start | null} start
 * @param {number} began performance.now() from which the seconds count */
async function train(chosen, start, began) {
    const {shape} = /** @type {FullState} */ (state), {read, team} = shape, hasColors = Boolean(read.colors);
    const mine = state.training = /** @type {Training} */ ({isPaused: false, isStopped: false, paused: 0});
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
        state.result = /** @type {Result} */ ({...trained, settings, seconds: clock(), isSaved: false});
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

/** Keeps a result in the browser's storage, for a reload; the facets are quickly made again.
 * @param {Pick<Result, keyof Trained | "settings" | "seconds">} result */
function remember({levels, texture, settings, seconds}) {
    const {shape} = /** @type {FullState} */ (state);
    keep({...factsOfShape(shape), read: {...shape.read, facets: null}, levels, texture, settings, seconds});
}

// Trains the shape on the stage anew.
async function trainAgain() {
    const {read, crease, up, front} = /** @type {FullState} */ (state).shape;
    const settings = chosenSettings(), began = performance.now();
    const isReady = !read.facets || settings.crease === crease || await showAgain({read, settings, up, front});
    if (isReady) await train(settings, null, began);
}

/** Shows a shape that was read before. @param {Pick<Kept, "read" | "settings" | "up" | "front">} shape */
async function showAgain({read, settings, up, front}) {
    const isWanted = await showShapeOf({earlier: read}, read.name, settings);
    /** @type {FullState} */ (state).shape.front = front;
    turnTo(up);
    return isWanted;
}

/** Goes on with what a reload left. @param {Kept} record */
async function resume(record) {
    const {read, settings, seconds, levels, texture} = record;
    if (!await showAgain(record)) return;
    const isWhole = levels.length === settings.levels.length && (texture || !read.colors);
    if (!isWhole)
        return train(settings, {levels, texture, weights: null, share: 0}, performance.now() - 1000 * seconds);
    state.result = /** @type {Result} */ ({levels, texture, settings, seconds, isSaved: false});
    update("");
    return showResult();
}

// Shows the trained model, and what it can be saved as.
async function showResult() {
    const {shape, result} = /** @type {FullState & {result: Result}} */ (state);
    const {line, isFar} = judged(result, !shape.read.faces.length);
    Object.assign(result, {isFar, bytes: modelFile(factsOfShape(shape), result, provenanceOf(shape, result))});
    update(line);
    element("ended").textContent = line;
    element("settings")[isFar ? "prepend" : "append"](element("longer"));
    const model = {...trainedModel(factsOfShape(shape), result), ground: groundOf(shape)};
    const onSave = (/** @type {string} */ id) => {
        result.isSaved ||= id === "download";
    };
    showExports(element("exports"), shape.name, kindsOf(shape, result, model, recorded), onSave, guarded);
    drawBoth();
    await startParsed(model);
    while (!renderer.seen && !renderer.device.lost) await pause(30);
    if (isCurrent(result)) showPicture("field");
}

/** @param {Result | null} result */
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
    const {levels, texture, settings} = /** @type {Result} */ (state.result), last = levels[levels.length - 1];
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
    const {shape, training, result} = /** @type {FullState} */ (state);
    turnTo(UPS[(UPS.indexOf(shape.up) + 1) % UPS.length]);
    if (training?.live) Object.assign(training.live, {shape: factsOfShape(shape), ground: groundOf(shape), drawnAt: 0});
    if (result && !training) await showResult();
    else draw(false);
}

// Makes the present view the one on which the model opens.
async function setFront() {
    center(/** @type {FullState} */ (state).shape.front = frontOfView());
    notify("Front set. The model opens on this view");
    setTimeout(notify, NOTICED, "");
    if (state.result && !state.training) await showResult();
}

/** @param {string} text */
function notify(text) {
    element("ended").textContent = notice = text;
    update("");
}

const stem = (/** @type {string} */ name) => name.replace(/\.\w+$/, "").replace(CONTROLS, "").slice(0, 60) || "shape";

/** Returns the error for the visitor. @param {unknown} error @param {string} name of the shape's file */
const understood = (error, name) => (
    error instanceof TrainingError ? new ModelError(`${name.replace(CONTROLS, "?")}: ${error.message}`) : error
);

/** Shows a line, and a bar unless share is null; and the buttons of this moment. line: "" keeps the one before.
 * @param {string} line @param {number | null} share */
function update(line, share = null) {
    const {shape, training, result} = state, bar = element("trained"), isIdle = shape && !training;
    if (line) {
        report = line;
        bar.value = share ?? 0; // a bar of an unknown share would move, and drawing that slows the training down
    }
    element("report").textContent = notice || report;
    /** @type {HTMLElement} */ (element("report").parentElement).hidden = !shape && !training;
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

/** @returns {Settings} */
function chosenSettings() {
    const texts = /** @type {Record<string, string>} */ (Object.fromEntries(new FormData(element("settings"))));
    return /** @type {Settings | null} */ (facts.studio.fixed) ?? settingsFrom(texts.preset, texts);
}

/** @param {string} preset */
function fillSettings(preset) {
    const {levels, seconds} = facts.studio.presets[preset];
    inputs.levels.value = levels;
    inputs.seconds.value = String(seconds);
}

/** Returns an action of a button that shows its errors. @param {() => unknown} action */
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
    inputs.crease.placeholder = String(facts.studio.crease);
    const buttons = {
        choose: () => element("file").click(),
        another: () => element("file").click(),
        longer: trainLonger,
        again: trainAgain,
        up: turnUp,
        front: setFront,
        pause: () => {
            const {training} = state;
            if (training) training.isPaused = !training.isPaused;
            update("");
        },
        stop: () => {
            if (state.training) state.training.isStopped = true;
        },
    };
    for (const [id, action] of Object.entries(buttons)) element(id).addEventListener("click", guarded(action));
    for (const button of element("examples").querySelectorAll("button")) {
        const question = {example: Number(button.dataset.example)};
        button.disabled = lacking() !== "";
        button.addEventListener("click", guarded(() => openAndTrain(question, button.textContent, performance.now())));
    }
    element("settings").addEventListener("submit", (event) => event.preventDefault());
    element("more").addEventListener("keydown", ({key}) => {
        element("more").open &&= key !== "Escape";
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
    const offer = /** @type {HTMLElement} */ (button.parentElement);
    if (!record) return;
    button.textContent = `Go on with ${record.name}`;
    offer.hidden = false;
    button.disabled = lacking() !== "";
    button.addEventListener("click", guarded(() => resume(record)));
    element("forget").addEventListener(
        "click",
        guarded(async () => {
            await forget();
            offer.hidden = true;
        }),
    );
}

wireStudio();
