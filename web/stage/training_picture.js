import {memoryOf} from "../draw/remembered_variant.js";
import {parameterCount} from "../kernel/kernel.js";
import {facts} from "../model/facts.js";
import {pause} from "../model/pause.js";
import {printField} from "../print/field.js";
import {trainedModel} from "../save/model_file.js";
import {paddedNetwork} from "../train/training.js";
import {goToLevel, start} from "../view/current_model.js";
import {renderer} from "../view/view.js";
/** @import {KernelWeights} from "../kernel/layers.js" */
/** @import {FileShape} from "./state.js" */

const LONGEST = 1000; // milliseconds that a training waits for its picture
const REACH = 0.03; // half-width of an unfinished level's band; rays enter the ball of radius 1 + delta
/** Finished networks; unfinished: the next, or null.
 * @typedef {{levels: TrainedLevel[], texture?: KernelWeights | null, unfinished?: KernelWeights | null}} Moment */

/** The picture of a training's weights of this moment. Its shader has all networks from the start, so that it compiles
 * once, during the preparation; networks to come are zero. */
export class LivePicture {
    /** @param {FileShape} shape @param {number} ground height of the lowest point, model units
     * @param {Settings} settings @param {boolean} hasColors */
    constructor(shape, ground, settings, hasColors) {
        /** @param {Layout} layout @param {number} outputs */
        const bare = (layout, outputs) => {
            const network = paddedNetwork(layout, outputs), weights = new Float32Array(parameterCount(network));
            if (outputs > 1) weights.set(facts.studio.plain, weights.length - outputs);
            return {network, layout, weights};
        };
        this.shape = shape;
        this.ground = ground;
        this.isReady = false;
        this.drawnAt = this.level = 0;
        this.since = Infinity; // version of the first picture
        this.bare = {
            levels: settings.levels.map((layout) => bare(layout, 1)),
            texture: hasColors ? bare(settings.texture, 3) : null,
        };
        /** Comes back after a lost context. @type {Current} */
        this.shown = {
            model: this.model({levels: []}),
            probes: {points: [], values: []},
            storage: "texture",
            sha256: "",
            memory: memoryOf(""),
        };
    }

    // Compiles the shader. Resolves when it is ready.
    async compile() {
        await start(this.shown);
        this.isReady = true;
    }

    /** Draws the networks of this moment, and resolves when they are seen: where the processor draws, the training
     * waits, because both at once would take longer. @param {Moment} moment */
    async show(moment) {
        const model = this.shown.model = this.model(moment), count = this.known(moment).length;
        if (count !== this.level) goToLevel(this.level = count);
        this.since = Math.min(this.since, renderer.version + 1);
        const {texels} = printField(model, "texture", renderer.device.unroll);
        renderer.replace(model, /** @type {Float32Array} */ (texels));
        const until = performance.now() + LONGEST;
        await pause(0);
        while (!renderer.seen && performance.now() < until) await pause(5);
        this.drawnAt = performance.now();
    }

    /** Returns the levels of a moment, with the unfinished one.
     * @param {Moment} moment @returns {(TrainedLevel | KernelWeights)[]} */
    known({levels, unfinished = null}) {
        return unfinished && levels.length < this.bare.levels.length ? [...levels, unfinished] : levels;
    }

    /** @param {Moment} moment @returns {ShownModel} */
    model(moment) {
        const {levels, texture = null, unfinished = null} = moment, known = this.known(moment);
        const all = this.bare.levels.map((bare, i) => ({delta: REACH, ...known[i] ?? bare}));
        const isColoring = unfinished && levels.length === this.bare.levels.length;
        const colors = texture ?? (isColoring ? unfinished : this.bare.texture);
        return {
            ...withoutOutputBias(trainedModel(this.shape, {levels: all, texture: colors})),
            ground: this.ground,
            isUnfinished: true,
        };
    }
}

/** Returns a model with the biases of outputs as the weights of one more neuron, whose value is 1. Shaders store biases
 * of outputs as constants, so that new weights would else need a new shader. @param {Model} model */
export function withoutOutputBias(model) {
    return {
        ...model,
        levels: model.levels.map((level) => ({...level, network: withOne(level.network)})),
        texture: model.texture && withOne(model.texture),
    };
}

/** @param {Network} network @returns {Network} */
function withOne(network) {
    const [hidden, output] = network.slice(-2), {rows, columns} = output;
    /** @param {Float32Array} array @param {...number} more */
    const longer = (array, ...more) => Float32Array.from([...array, ...more]);
    const weight = new Float32Array(rows * (columns + 1));
    for (let c = 0; c < rows; ++c) {
        weight.set(output.weight.subarray(c * columns, (c + 1) * columns), c * (columns + 1));
        weight[c * (columns + 1) + columns] = output.bias[c];
    }
    return [
        ...network.slice(0, -2),
        {
            rows: hidden.rows + 1,
            columns: hidden.columns,
            weight: longer(hidden.weight, ...new Array(hidden.columns).fill(0)),
            bias: longer(hidden.bias, Math.PI / 2),
        },
        {rows, columns: columns + 1, weight, bias: new Float32Array(rows)},
    ];
}
