import {memoryOf} from "../draw/remembered_variant.js";
import {parameterCount} from "../kernel/kernel.js";
import {facts} from "../model/facts.js";
import {pause} from "../model/pause.js";
import {printField} from "../print/field.js";
import {trainedModel} from "../save/model_file.js";
import {paddedNetwork} from "../train/training.js";
import {goToLevel, start} from "../view/current_model.js";
import {renderer} from "../view/view.js";

// The picture of a training's weights of this moment. Its shader has all networks from the start, so that it compiles
// once, during the preparation; networks to come are zero.
const LONGEST = 1000; // milliseconds that a training waits for its picture
const REACH = 0.03; // half-width of an unfinished level's band; rays enter the ball of radius 1 + delta

export class LivePicture {
    // shape: see modelFile; ground: height of the lowest point, model units. settings, hasColors: see trainShape.
    constructor(shape, ground, settings, hasColors) {
        const bare = (layout, outputs) => {
            const network = paddedNetwork(layout, outputs), weights = new Float32Array(parameterCount(network));
            if (outputs > 1) weights.set(facts.studio.plain, weights.length - outputs);
            return {network, layout, weights};
        };
        Object.assign(this, {shape, ground, isReady: false, drawnAt: 0, level: 0});
        this.bare = {
            levels: settings.levels.map((layout) => bare(layout, 1)),
            texture: hasColors ? bare(settings.texture, 3) : null,
        };
    }

    // Compiles the shader. Resolves when it is ready.
    async compile() {
        const model = this.model({levels: []}), probes = {points: [], values: []};
        this.shown = {model, probes, storage: "texture", sha256: "", memory: memoryOf("")}; // comes back after a lost context
        await start(this.shown);
        this.isReady = true;
    }

    // Draws the networks of this moment, and resolves when they are seen: where the processor draws, the training waits,
    // because both at once would take longer. moment: {levels, texture}: finished networks; unfinished: the next, or null.
    async show(moment) {
        const model = this.shown.model = this.model(moment), count = this.known(moment).length;
        if (count !== this.level) goToLevel(this.level = count);
        this.since ??= renderer.version + 1; // of the first picture
        renderer.replace(model, printField(model, "texture", renderer.device.unroll).texels);
        const until = performance.now() + LONGEST;
        await pause(0);
        while (!renderer.seen && performance.now() < until) await pause(5);
        this.drawnAt = performance.now();
    }

    // Returns the levels of a moment, with the unfinished one.
    known({levels, unfinished = null}) {
        return unfinished && levels.length < this.bare.levels.length ? [...levels, unfinished] : levels;
    }

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

// Returns a model of parseModel with the biases of outputs as the weights of one more neuron, whose value is 1. Shaders
// store biases of outputs as constants, so that new weights would else need a new shader.
export function withoutOutputBias(model) {
    return {
        ...model,
        levels: model.levels.map((level) => ({...level, network: withOne(level.network)})),
        texture: model.texture && withOne(model.texture),
    };
}

function withOne(network) {
    const hidden = network.at(-2), output = network.at(-1), {rows, columns} = output;
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
