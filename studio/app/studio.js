import {openShapesWith, refuseShape, start, startParsed} from "./current_model.js";
import {facts} from "./facts.js";
import {pause} from "./device.js";
import {printField} from "./field.js";
import {withoutOutputBias} from "./live.js";
import {memoryOf} from "./memory.js";
import {parseMesh} from "./mesh_file.js";
import {MeshError} from "./mesh_parts.js";
import {element, fail, say} from "./messages.js";
import {modelFile} from "./model_file.js";
import {probes} from "./reference.js";
import {ModelError, parseModel} from "./safetensors.js";
import {Team} from "./team.js";
import {trainMesh} from "./training.js";
import {TrainingError} from "./training_error.js";
import {renderer} from "./view.js";

// The studio: trains a dropped mesh, while the page draws the field of this moment.
const MOST_WORKERS = 16;
const BETWEEN_PICTURES = 1000, BETWEEN_REPORTS = 200; // milliseconds
const PICTURES_SHARE = 0.2; // largest share of the time that pictures may take
const LIVE_DELTA = 0.03; // half-width of the unfinished level's band; rays enter the ball of radius 1 + delta
const INVITATION = element("report").textContent;
const READABLE = /\.(obj|ply|stl|glb)$/i;

// `training` is {team, isPaused, isStopped}, or null; `finished` is {name, bytes} of the last model.
let training = null, finished = null;

async function train(file) {
    if (!READABLE.test(file.name)) refuseShape(file);
    if (training) throw new ModelError("stop the training first");
    const mine = training = {team: null, isPaused: false, isStopped: false};
    try {
        say("");
        report("Reading the mesh");
        const {vertices, faces, center, scale} = normalized(parseMesh(file.name, await file.arrayBuffer()));
        const shape = {name: stem(file.name), center, scale, ground: lowest(vertices)};
        mine.team = new Team(element("worker").textContent, Math.min(navigator.hardwareConcurrency || 1, MOST_WORKERS));
        report(`Preparing ${(faces.length / 3).toLocaleString("en")} triangles`);
        const module = await WebAssembly.compile(bytesOf(element("kernel").textContent));
        await mine.team.all("load", () => ({module, vertices, faces}));
        const levels = await trainMesh(mine.team, facts.studio.settings, facts.studio.config, follow(mine, shape));
        await show(shape, levels);
    } catch (error) {
        report(INVITATION);
        throw error instanceof MeshError || error instanceof TrainingError ? new ModelError(error.message) : error;
    } finally {
        mine.team?.dismiss();
        training = null;
        showButtons();
    }
}

// Returns afterStep for trainMesh: it draws, reports, and waits during a pause.
function follow(mine, shape) {
    const {settings} = facts.studio, count = settings.levels.length, began = performance.now();
    const costs = settings.levels.map(({width, depth}, i) => settings.steps[i] * width * (4 + depth * width));
    const sum = (numbers) => numbers.reduce((total, number) => total + number, 0);
    let drawnLevels = 0, drawnAt = 0, reportedAt = 0, compilation = null, paused = 0;
    return async ({level, steps, loss, weights, levels, network, layout}) => {
        const now = performance.now();
        if (now > reportedAt + BETWEEN_REPORTS) {
            const done = sum(costs.slice(0, level - 1)) + costs[level - 1] * steps / settings.steps[level - 1];
            const share = done / sum(costs), left = (now - began - paused) / share * (1 - share) / 1000;
            const accuracy = levels.length ? ` · mean |f| of level ${levels.length}: ${levels.at(-1).meanF.toExponential(1)}` : "";
            report(`Level ${level} of ${count} · loss ${loss.toPrecision(3)}${accuracy} · ${Math.ceil(left)} s left`, share);
            showButtons();
            reportedAt = now;
        }
        const isDue = now > drawnAt + Math.max(BETWEEN_PICTURES, (renderer.refining?.frame ?? 0) / PICTURES_SHARE);
        if (isDue && !compilation) {
            const moment = [...levels, {network, layout, weights, delta: LIVE_DELTA, lipschitz: 1}];
            const model = {...withoutOutputBias(parseModel(modelFile(shape, moment, {}).buffer)), ground: shape.ground};
            if (moment.length === drawnLevels) {
                renderer.replace(model, printField(model, "texture", renderer.device.unroll).texels);
            } else {
                element("poster").hidden = true;
                compilation = start({model, probes: probes(model), storage: "texture", shadertoy: null, memory: memoryOf("")})
                    .catch(fail).finally(() => { compilation = null; });
                drawnLevels = moment.length;
            }
            drawnAt = now;
        }
        while (mine.isPaused && !mine.isStopped) await pause(50);
        paused += performance.now() - now;
        return mine.isStopped ? "stop" : "";
    };
}

// Shows the trained model, and offers its file.
async function show(shape, levels) {
    const figures = levels.map(({meanF, angle, steps}) => ({mean_abs_f: meanF, degrees: angle, steps}));
    const bytes = modelFile(shape, levels, {made_by: "page", levels: figures, seed: facts.studio.settings.seed});
    offer({name: shape.name, bytes});
    const {meanF, angle} = levels.at(-1);
    report(`Trained · mean |f| ${meanF.toExponential(1)} of the radius · normals off by ${angle.toFixed(1)}°`);
    await startParsed(parseModel(bytes.buffer));
}

// Moves the center of the bounding box to the origin, and scales the largest norm to 1, as normalize() in
// trainer/shapes/shape.py.
function normalized({vertices, faces}) {
    const least = [Infinity, Infinity, Infinity], most = [-Infinity, -Infinity, -Infinity];
    vertices.forEach((c, i) => {
        least[i % 3] = Math.min(least[i % 3], c);
        most[i % 3] = Math.max(most[i % 3], c);
    });
    const center = least.map((c, k) => (c + most[k]) / 2), moved = vertices.map((c, i) => c - center[i % 3]);
    let scale = 0;
    for (let i = 0; i < moved.length; i += 3) scale = Math.max(scale, Math.hypot(moved[i], moved[i + 1], moved[i + 2]));
    if (!(scale > 0 && scale < Infinity)) throw new ModelError("all vertices are at one place, or too far apart");
    return {vertices: moved.map((c) => c / scale), faces, center, scale};
}

function lowest(vertices) {
    let y = Infinity;
    for (let i = 1; i < vertices.length; i += 3) y = Math.min(y, vertices[i]);
    return y;
}

const stem = (name) => name.replace(/\.\w+$/, "").replace(/[\p{C}\p{Zl}\p{Zp}]/gu, "").slice(0, 60) || "shape";
const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

// Shows a line, and a bar unless share is null.
function report(line, share = null) {
    const bar = element("trained");
    element("report").textContent = line;
    bar.hidden = share === null;
    bar.value = share ?? 0;
}

function offer(model) {
    finished = model;
    showButtons();
}

function showButtons() {
    for (const id of ["pause", "stop"]) element(id).hidden = !training;
    element("pause").textContent = training?.isPaused ? "Go on" : "Pause";
    element("download").hidden = !finished;
    element("mesh").hidden = Boolean(training);
    if (finished) element("download").textContent = `Save ${finished.name} (${(finished.bytes.length / 1000).toFixed(1)} kB)`;
}

function download() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([finished.bytes]));
    link.download = `${finished.name.replace(/[^\p{L}\p{N}_-]+/gu, "-")}.safetensors`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    finished.isSaved = true;
}

function wireStudio() {
    openShapesWith(train);
    const buttons = {
        mesh: () => element("file").click(), download,
        pause: () => { training.isPaused = !training.isPaused; showButtons(); },
        stop: () => { training.isStopped = true; },
    };
    for (const [id, action] of Object.entries(buttons)) element(id).addEventListener("click", action);
    addEventListener("beforeunload", (event) => {
        if (training || (finished && !finished.isSaved)) event.preventDefault();
    });
}

wireStudio();
