import {pause} from "../model/pause.js";
import {TEXTURE_WIDTH} from "../print/texels.js";
import {countsOf, emptyCells} from "./cells.js";
import {uniforms, withOptions} from "./uniforms.js";

// The model's shader has two variants: weights in a texture, or as literals. The texture variant is ready at once. The
// literal variant compiles after the first picture, because slow drivers draw nothing meanwhile; the faster one stays.
/** @import {memoryOf} from "./remembered_variant.js"
 * @import {Painter} from "./painter.js"
 * @import {Uniforms} from "./uniforms.js"
 * @typedef {ReturnType<typeof memoryOf>} Memory */
// Milliseconds: longest compilation of literals; longest wait for the first picture before it.
const LITERAL_LIMIT = 60000, LITERAL_DELAY = 30000;

export class Variants {
    /** @type {Variant | null} The active one. */ current = null;
    /** @type {Probes} */ probes;
    generation = 0;

    /** @param {Painter} painter @param {Scene} scene load() sets its model
     * @param {Listener & {settled: () => boolean}} listener settled: whether the picture is complete */
    constructor(painter, scene, listener) {
        this.painter = painter;
        this.scene = scene;
        this.listener = listener;
    }

    /** Loads a model, and resolves when its texture variant is ready. field, literal: from printField for the two
     * variants; literal: null to skip it. A later call, or a lost context, cancels this one.
     * @param {ShownModel} model @param {PrintedField} field @param {PrintedField | null} literal
     * @param {Probes} probes @param {Memory | null} memory */
    async load(model, field, literal, probes, memory) {
        const {device} = this.painter, generation = ++this.generation;
        const isWanted = () => generation === this.generation && !device.lost;
        device.check(field.height);
        const variant = await this.compile("texture", field, model, isWanted);
        await this.painter.exclusively(async () => {
            if (!variant || !isWanted()) return this.drop(variant);
            this.drop(this.current);
            Object.assign(this.scene, {model, cells: null});
            this.painter.passes.setCells(null);
            this.probes = probes;
            await this.warm(variant);
            await this.keep(variant, isWanted);
            this.listener.loaded();
        });
        if (isWanted()) device.unlessLost(this.findCells(model, isWanted)).catch(this.listener.failed);
        const isPossible = memory && literal && device.patient && device.survives(literal.text);
        if (isWanted() && isPossible && !["texture", "trying"].includes(/** @type {string} */ (memory.read())))
            device.unlessLost(this.race(literal, isWanted, memory)).catch(this.listener.failed);
    }

    /** Replaces the weights of the texture variant. model: of the same layers; texels: of its printField.
     * @param {ShownModel} model @param {Float32Array} texels */
    replace(model, texels) {
        ++this.generation; // cancels the search for cells of the old weights
        const {weights} = /** @type {Variant & {weights: WebGLTexture}} */ (this.current);
        this.painter.device.write(weights, TEXTURE_WIDTH, texels);
        Object.assign(this.scene, {model, cells: null});
        this.painter.passes.setCells(null);
    }

    /** Computes the grids of cells, coarse ones first, while the page draws without.
     * @param {ShownModel} model @param {() => boolean} isWanted */
    async findCells(model, isWanted) {
        for (const count of countsOf(model)) {
            const cells = await emptyCells(model, count, isWanted, () => pause(0));
            if (!cells) return;
            await this.painter.exclusively(() => {
                if (!isWanted()) return;
                this.painter.passes.setCells(cells);
                this.scene.cells = cells;
            });
        }
    }

    /** Compiles the literals while the other variant draws, times both on the current view, and keeps the faster.
     * @param {PrintedField} literal @param {() => boolean} isWanted @param {Memory} memory */
    async race(literal, isWanted, memory) {
        const {painter, scene} = this, remembered = memory.read();
        const isEarly = () => remembered !== "literal" && isWanted() && !this.listener.settled();
        for (let waited = 0; waited < LITERAL_DELAY && isEarly(); waited += 100) await pause(100);
        if (!isWanted()) return;
        memory.write("trying");
        this.listener.trying(true);
        const variant = await this.compile("literal", literal, scene.model, isWanted, LITERAL_LIMIT).catch(() => null);
        await painter.exclusively(async () => {
            if (!isWanted()) return this.drop(variant);
            if (!variant) return memory.write("texture");
            await this.warm(variant);
            const current = /** @type {Variant} */ (this.current), values = uniforms(scene, current.loops, [256, 256]);
            const faster = remembered === "literal"
                || await this.time(variant, values) < await this.time(current, values);
            this.drop(faster ? current : variant);
            memory.write(faster ? "literal" : "texture");
            if (faster) await this.keep(variant, isWanted);
        }).finally(() => isWanted() && this.listener.trying(false));
    }

    /** Returns a variant of a printed field; null if it is no longer wanted, or takes longer than `limit`
     * milliseconds.
     * @param {Variant["storage"]} storage @param {PrintedField} field @param {Model} model
     * @param {() => boolean} isWanted @returns {Promise<Variant | null>} */
    async compile(storage, {text, texels, height, loops}, model, isWanted, limit = Infinity) {
        const {painter} = this, {device, passes} = painter, {gl} = device, start = performance.now();
        const levels = `const int LEVELS = ${model.levels.length};`;
        const opening = painter.source("prologue").replace(/const int LEVELS ?= ?\d+;/, levels);
        const shader = (/** @type {string} */ name) =>
            `${opening}\n${passes.defines(model)}${text}\n${painter.shader(`${name}.glsl`)}`;
        const vertices = (
            /** @type {string} */ name,
        ) => (passes.inBlocks(name) ? painter.vertexShader("blocks") : undefined);
        const begun = passes.names(storage).map((
            name,
        ) => /** @type {const} */ ([name, device.begin(shader(name), vertices(name))]));
        while (!begun.every(([, one]) => device.isReady(one))) {
            await pause(15);
            if (isWanted() && performance.now() - start < limit) continue;
            if (!device.lost) begun.forEach(([, {program}]) => gl.deleteProgram(program));
            return null;
        }
        await device.done(); // a query of the result would wait, and block the page, while the device is busy
        const programs = Object.fromEntries(begun.map(([name, one]) => [
            name,
            {...device.finish(one), inBlocks: passes.inBlocks(name)},
        ]));
        const weights = height ? device.texture(gl.RGBA32F, TEXTURE_WIDTH, height, gl.NEAREST, texels) : null;
        return {storage, programs, weights, loops: device.limitsLoops ? loops : null, cost: 0, proven: false};
    }

    /** @param {Variant | null} variant */
    drop(variant) {
        const {gl} = this.painter.device;
        Object.values(variant?.programs ?? {}).forEach(({program}) => gl.deleteProgram(program));
        gl.deleteTexture(variant?.weights ?? null);
    }

    /** @param {Variant} variant @param {() => boolean} isWanted */
    async keep(variant, isWanted) {
        this.current = variant;
        const error = await this.error(variant);
        if (isWanted()) this.listener.stored(variant.storage, error);
    }

    /** Draws a first pixel, where drivers do most of their compilation. @param {Variant} variant */
    async warm(variant) {
        const {painter, scene} = this;
        const coarse = withOptions(scene, {level: 1, normalLevel: 1, shading: "softbox"}); // uses all passes
        for (const newton of [0, 1])
            painter.draw(variant, {...uniforms(coarse, variant.loops, [1, 1]), newton}, [0, 0], [1, 1]);
        await painter.device.done();
    }

    /** Returns the milliseconds to draw the center of a 256 x 256 picture.
     * @param {Variant} variant @param {Uniforms} values */
    async time(variant, values) {
        for (let count = 1;; count *= 4) {
            const start = performance.now();
            for (let k = 0; k < count; ++k) this.painter.draw(variant, values, [96, 96], [64, 64]);
            await this.painter.device.done();
            const milliseconds = performance.now() - start;
            if (milliseconds > 60 || count > 100) return milliseconds / count;
        }
    }

    /** Returns the largest difference between the shader's field and the probes' values; null if the device cannot
     * measure it. The field f at a point is the end t = f of a ray from there after one step of scale 1.
     * @param {Variant} variant */
    async error(variant) {
        const {painter, scene, probes: {points, values: expected}} = this, levels = scene.model.levels.length;
        if (!painter.device.float || !expected.length) return null;
        const values = {
            ...uniforms(withOptions(scene, {level: levels, normalLevel: levels, shading: "data", time: 0}), null, [
                1,
                1,
            ]),
            schedule: 0,
            newton: 0,
            rounds: 1,
            iterations: Array(levels).fill(1),
            step_scale: [1],
            step_bound: Array(levels).fill(1),
            band_step_bound: Array(levels).fill(1),
        };
        expected.forEach((_, k) => {
            const camera = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, ...points.slice(3 * k, 3 * k + 3), 1];
            painter.draw(variant, {...values, camera}, [0, 0], [1, 1], [k, 0]);
        });
        await painter.device.done();
        const measured = painter.reds(expected.length);
        return Math.max(...expected.map((value, k) => Math.abs(measured[k] - value)));
    }
}
