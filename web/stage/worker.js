import {Batches} from "../kernel/batches.js";
import {COLOR, DIRECTION, DISTANCE, GRADIENT, NORMAL, SAMPLE, VALUE} from "../kernel/kernel.js";
import {Kernel} from "../kernel/kernel_instance.js";
import {randomNumbers} from "../kernel/random.js";
import {TrainingError} from "../kernel/training_error.js";
import {FLATTEST} from "../model/constants.js";
import {MeshError} from "../read/mesh_parts.js";
import {fieldMesh, resolutionFor} from "../save/field_mesh.js";
import {glbBytes, plyBytes} from "../save/mesh_writer.js";
import {CloudShape} from "../shape/cloud.js";
import {input, withFacets} from "../shape/load_shape.js";
import {Shape} from "../shape/shape.js";
import {bendOf} from "../shape/surface_bend.js";
import {hardSamples} from "../train/mining.js";
import {addNested, addNetwork} from "../train/nested.js";
import {bandPoints, bandSamples, domainSamples, findStrays} from "../train/sampling.js";
import {traced} from "../train/tracing.js";
import {cornersOf} from "./preview_buffers.js";
/** @import {InputFile} from "../read/mesh_file.js" */
/** @import {FacetedShape, PlacedShape} from "../shape/load_shape.js" */
/** @import {TrainingShape} from "../shape/surface.js" */
/** @import {BareLevel, BareNetwork} from "../train/nested.js" */
/** @import {StepAnswer, StepQuestion} from "../train/optimize.js" */

// A worker of a training. It has the shape, draws its own share of the samples, and computes its share of each step.
const TERMS = ["value", "normal", "distance", "eikonal"]; // of a level's loss, in the kernel's order

/** A stage. pool: number of samples on the surface, and off it; on, around: the same for one step; team: number of
 * workers; seed: of all random numbers; levels: those before.
 * @typedef {{network: KernelNetwork, levels: BareLevel[], pool: number, on: number, around: number, team: number,
 *     seed: number}} Begin */
/** hard: mined samples, of which a step takes the share. A texture's has only the numbers of a step.
 * @typedef {Omit<Begin, "seed"> & {random: () => number, hard: Batches | null, hardShare: number, isTexture?: boolean}}
 *     Task */
/** @typedef {typeof answers} Answers */

let /** @type {Kernel} */ kernel, /** @type {TrainingShape} */ shape, /** @type {Batches} */ surface;
let /** @type {Batches} */ volume, /** @type {Task | null} */ task;

const answers = {
    /** Reads a shape, from files or an example, and moves it to model space; or takes the input of an earlier call,
     * which was kept. plain: color of a shape without colors, sRGB. Returns the input with its facets, and the buffers
     * of its preview. @param {{files?: InputFile[], example?: number, earlier?: PlacedShape, plain: Vector,
     *     crease: number | null}} question */
    async read({files, example, earlier, plain, crease}) {
        const {read, corners} = withFacets(earlier ?? await input(files, /** @type {number} */ (example)), crease);
        return {...read, preview: cornersOf(read, corners, plain)};
    },

    /** @param {{module: WebAssembly.Module, read: FacetedShape}} question module: the compiled kernel */
    load({module, read}) {
        kernel = new Kernel(module);
        const {vertices, faces, cloudNormals, colors, facets} = read;
        shape = cloudNormals ?
            new CloudShape(vertices, cloudNormals, colors)
            : new Shape(vertices, faces, colors, facets ?? undefined);
    },

    /** @param {BendConfig} config */
    bend(config) {
        return bendOf(shape, config);
    },

    /** Draws the samples of a level, and prepares for its steps. @param {Begin & {config: SamplingConfig}} question */
    begin({network, levels, pool, on, around, team, seed, config}) {
        const random = randomNumbers(seed), rows = shape.surface(pool, random);
        task = {on, around, team, pool, network, levels, random, hard: null, hardShare: 0};
        addLevels(levels, rows, false);
        surface = new Batches(rows, random);
        volume = new Batches(volumeSamples(levels, pool, team, config, random), random);
        kernel.prepare(network, on + around);
    },

    /** Draws the samples of the texture. @param {Begin & {colors: number}} question color samples for each of the pool
     */
    beginTexture({network, levels, pool, on, around, team, seed, colors}) {
        task = /** @type {Task} */ ({on, around, team, isTexture: true});
        const random = randomNumbers(seed), tints = new Float32Array(3 * pool * colors);
        const colored = shape.surface(pool * colors, random, tints);
        const addFirst = (/** @type {Float32Array} */ some) => addLevels(levels.slice(0, 1), some, false),
            none = new Float32Array(0);
        const band = bandPoints(shape, pool, levels[0].delta, addFirst, none, random);
        surface = new Batches(textureSamples(colored, levels, tints), random);
        volume = new Batches(textureSamples(band, levels, null), random);
        kernel.prepare(network, on + around);
    },

    /** Mines hard samples of the level under training, for its later steps. weights: its present ones.
     * @param {StepQuestion & {config: Pick<Config, "sampling" | "mining">}} question */
    mine({weights, factors, config}) {
        const own = /** @type {Task} */ (task),
            {on, around, team, pool, network, levels, random, hard} = own,
            isFirst = !levels.length,
            {mining} = config;
        const count = Math.min(pool, Math.floor((isFirst ? mining.first_candidates : mining.candidates) / team));
        const level = {
            isFirst,
            near: factors.near,
            delta: isFirst ? config.sampling.first_band : levels[levels.length - 1].delta,
            addFrozen: (/** @type {Float32Array} */ some) => addLevels(levels, some, true),
            addLevel: (/** @type {Float32Array} */ some) => addNetwork(kernel, {network, weights}, some),
        };
        const rows = hardSamples(shape, level, hard?.rows ?? new Float32Array(0), count, config, random);
        own.hard = rows.length < SAMPLE * mining.fewest ? null : new Batches(rows, random);
        own.hardShare = isFirst ? mining.first_share : shape.isExact ? mining.exact_share : mining.share;
        kernel.prepare(network, on + around);
        return rows.length / SAMPLE;
    },

    /** Returns this worker's share. @param {StepQuestion} question @returns {StepAnswer} */
    step({weights, factors}) {
        const {on, around, team, isTexture} = /** @type {Task} */ (task), {exports, terms} = kernel;
        kernel.weights.set(weights);
        drawBatch();
        if (isTexture) {
            exports.texture_step(on + around, on, on * team, (on + around) * team, factors.smoothness);
            return {gradient: kernel.gradient.slice(), loss: terms[0] + factors.smoothness * terms[1], meanF: 0};
        }
        kernel.setLoss(factors);
        exports.level_step(on + around, on, on * team, around * team);
        const loss = TERMS.reduce((sum, name, k) => sum + factors[name] * terms[k], 0);
        return {gradient: kernel.gradient.slice(), loss, meanF: terms[TERMS.length]};
    },

    /** Returns this worker's samples of the last step, or of a new one. @param {{isNew: boolean}} question */
    samples({isNew}) {
        if (isNew) drawBatch();
        return kernel.samples.slice();
    },

    /** Measures the last of the levels on the surface: at `count` new points and at this worker's share of the
     * vertices. Returns {count, f, distance, angle: sums over new points; largest, steepest: largest |f| and |grad f|
     * of all points}. distance: from the point to the model's surface, |f| / |grad f|. worker: its number, or null for
     * no vertices.
     * @param {{levels: BareLevel[], count: number, seed: number, worker: number | null, team: number}} question */
    measure({levels, count, seed, worker, team}) {
        task = null;
        const drawn = shape.surface(count, randomNumbers(seed));
        const result = {count, f: 0, distance: 0, angle: 0, largest: 0, steepest: 0};
        for (const rows of [drawn, worker === null ? new Float32Array(0) : shape.corners(worker, team)]) {
            addLevels(levels, rows, false);
            for (let at = 0; at < rows.length; at += SAMPLE) {
                const f = Math.abs(rows[at + VALUE]), gradient = rows.subarray(at + GRADIENT, at + DISTANCE);
                const slope = Math.hypot(...gradient);
                result.largest = Math.max(result.largest, f);
                result.steepest = Math.max(result.steepest, slope);
                if (rows !== drawn) continue;
                result.f += f;
                result.distance += f / Math.max(slope, FLATTEST);
                result.angle += angleBetween(gradient, rows.subarray(at + NORMAL, at + SAMPLE));
            }
        }
        return result;
    },

    /** Measures the step bounds along this worker's share of the rays. See traced().
     * @param {{levels: BareLevel[], seed: number, team: number, config: TracingConfig}} question */
    trace({levels, seed, team, config}) {
        const random = randomNumbers(seed), aims = shape.surface(Math.ceil(config.rays / team), random);
        const share = {...config, worst: Math.ceil(config.worst / team)};
        return traced((rows) => addNested(kernel, levels, rows), levels.map(({delta}) => delta), aims, random, share);
    },

    /** Returns the surface of a trained model as the bytes of a file. format: "ply" or "glb"; triangles: about their
     * number; others: of fieldMesh().
     * @param {{format: string, levels: BareLevel[], texture: BareNetwork | null, triangles: number,
     *     place: {center: Vector, scale: number}}} question */
    mesh({format, levels, texture, triangles, place}) {
        task = null;
        const mesh = fieldMesh(kernel, levels, texture, resolutionFor(triangles, kernel, levels), place);
        return {bytes: format === "glb" ? glbBytes(mesh) : plyBytes(mesh), triangles: mesh.faces.length / 3};
    },
};

function drawBatch() {
    const {on, around, hard, hardShare} = /** @type {Task} */ (task), mined = hard ? Math.round(hardShare * around) : 0;
    surface.draw(on, kernel.samples, 0);
    volume.draw(around - mined, kernel.samples, on);
    hard?.draw(mined, kernel.samples, on + around - mined);
}

/** @param {Float32Array} gradient @param {Float32Array} normal */
function angleBetween(gradient, normal) {
    const along = gradient[0] * normal[0] + gradient[1] * normal[1] + gradient[2] * normal[2];
    return Math.acos(Math.min(1, Math.max(-1, along / Math.max(Math.hypot(...gradient), 1e-8))));
}

/** @param {BareLevel[]} levels @param {number} pool @param {number} team @param {SamplingConfig} config
 * @param {() => number} random */
function volumeSamples(levels, pool, team, config, random) {
    if (!levels.length) return domainSamples(shape, pool, config, random);
    const {delta} = levels[levels.length - 1],
        addField = (/** @type {Float32Array} */ rows) => addLevels(levels, rows, true);
    const strays = findStrays(shape, delta, addField, Math.floor(pool * config.stray_share), 1 / team, config, random);
    return bandSamples(shape, pool, delta, addField, strays, config, random);
}

/** Returns rows in the form of a texture's samples (kernel/siren.c). Their direction is the gradient of the finest
 * level that is defined there (Eq. 3).
 * @param {Float32Array} rows @param {BareLevel[]} levels @param {Float32Array | null} colors of the rows */
function textureSamples(rows, levels, colors) {
    for (let at = 0; at < rows.length; at += SAMPLE) rows.fill(0, at + VALUE, at + DISTANCE);
    addNested(kernel, levels, rows);
    for (let at = 0; at < rows.length; at += SAMPLE) {
        rows.copyWithin(at + DIRECTION, at + GRADIENT, at + GRADIENT + 3);
        rows[at + DIRECTION + 3] = 0; // of the time
        if (colors) rows.set(colors.subarray(at / SAMPLE * 3, at / SAMPLE * 3 + 3), at + COLOR);
    }
    return rows;
}

/** Adds the values and gradients of levels to rows of samples. nested: makes the value infinite where a level is not
 * defined, outside the bands before it (Eq. 3).
 * @param {BareLevel[]} levels @param {Float32Array} rows @param {boolean} nested */
function addLevels(levels, rows, nested) {
    for (const level of levels) {
        addNetwork(kernel, level, rows);
        for (let at = VALUE; nested && at < rows.length; at += SAMPLE) {
            if (!(Math.abs(rows[at]) < level.delta)) rows[at] = Infinity;
        }
    }
}

/** @param {MessageEvent<{id: number, name: keyof Answers, data: never}>} message */
self.onmessage = async ({data: {id, name, data}}) => {
    try {
        const answer = await answers[name](data);
        /** @type {Worker} */ (/** @type {unknown} */ (self)).postMessage({id, answer}, buffersOf(answer));
    } catch (error) {
        const isExpected = error instanceof TrainingError || error instanceof MeshError;
        self.postMessage({id, error: /** @type {Error} */ (error).message ?? String(error), isExpected});
    }
};

/** Returns the buffers of the arrays in an answer, which it hands over. @param {unknown} answer */
function buffersOf(answer) {
    const arrays = ArrayBuffer.isView(answer) ? [answer] : Object.values(answer ?? {}).flatMap((value) => (
        ArrayBuffer.isView(value)
            ? [value]
            : value?.constructor === Object
            ? Object.values(value).filter(ArrayBuffer.isView)
            : []
    ));
    return /** @type {ArrayBuffer[]} */ ([...new Set(arrays.map(({buffer}) => buffer))]);
}
