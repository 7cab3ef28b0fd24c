import {shared} from "../model/facts.js";
import {FOCAL, matrix} from "./camera.js";

// The uniforms of the model's shader.
/** @typedef {ReturnType<typeof uniforms> & {scattered?: number, origin?: number[]}} Uniforms */

/** Returns an object from uniforms to numbers or lists, for sample k of every pixel of a [width, height] picture.
 * loops: the field's loop iterations (field.js) where the driver limits them; else null.
 * @param {Scene} scene @param {Loops | null} loops @param {number[]} size */
export function uniforms({model, camera, options, cells}, loops, [width, height], k = 0) {
    const {defaults, shadings} = shared;
    const [level, normalLevel] = [options.level, options.normalLevel ?? options.level]
        .map((wanted) => Math.min(wanted, model.levels.length));
    const skips = Boolean(cells) && level === model.levels.length; // the grid is of the last level
    const newton = skips && level === normalLevel;
    const {steps, rounds} = fitting(loops, level, normalLevel, stepsOf(model, options), defaults.rounds[0], newton);
    return {
        resolution: [width, height],
        jitter: jitter(k),
        camera: matrix(camera, width / height),
        focal: [FOCAL],
        level,
        normal_level: normalLevel,
        iterations: steps,
        rounds,
        delta: model.levels.map(({delta}) => delta),
        step_bound: model.levels.map(({bounds}) => bounds.step_bound),
        band_step_bound: model.levels.map(({bounds}) => bounds.band_step_bound),
        step_scale: defaults.step_scale,
        shading: shadings.indexOf(options.shading),
        light: options.light,
        ground: [model.ground],
        background_bottom: options.background[0],
        background_top: options.background[1],
        time: [options.time],
        schedule: defaults.schedule[0],
        skips: Number(skips), // the grid of cells (passes.js)
        newton: Number(newton), // newton_step() before the trace (gradient.glsl, trace_with_normal.glsl)
    };
}

/** @param {Scene} scene @param {Partial<Options>} options */
export function withOptions(scene, options) {
    return {...scene, options: {...scene.options, ...options}};
}

/** Returns the steps per round at each level. @param {Model} model @param {Options} options */
export function stepsOf(model, options) {
    return model.levels.map(({iterations}) => Math.max(1, Math.round(iterations * options.iterations)));
}

/** Reduces steps and rounds until llvmpipe's loop limit suffices, as schedule_that_fits in viewer/draw/loop_limit.py
 * for the relaxed schedule. If one round is too long, returns one round. newton: whether rays take newton_step()
 * first.
 * @param {Loops | null} loops @param {number} level @param {number} normalLevel @param {number[]} steps
 * @param {number} rounds */
export function fitting(loops, level, normalLevel, steps, rounds, newton = false) {
    if (!loops) return {steps, rounds};
    const softbox = shared.softbox_evaluations * (1 + loops.value[0]) + 1;
    const newtonStep = 6 + shared.cells.lookups + loops.value[level - 1] + loops.gradient[level - 1];
    const once = 1 + softbox + shared.cells.lookups + loops.gradient[normalLevel - 1] + loops.texture +
        (newton ? newtonStep : 0);
    const round = () => 4 + steps[level - 1] * (2 + loops.value[level - 1]);
    const isTooLong = () => rounds * round() + once > shared.loop_limit;
    if (isTooLong())
        steps = steps.map((count, i) => (i === level - 1 ? Math.min(count, shared.least_steps) : count));
    while (rounds > 1 && isTooLong()) --rounds;
    return {steps, rounds};
}

/** Returns the offset of sample k, pixels: 0, and then a low-discrepancy sequence. @param {number} k */
export function jitter(k) {
    return k ? [(0.5 + k * 0.7548776662) % 1 - 0.5, (0.5 + k * 0.5698402910) % 1 - 0.5] : [0, 0];
}
