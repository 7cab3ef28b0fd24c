import {FOCAL, matrix} from "./camera.js";

// What the model's shader is told before a draw.
// A scene is {defaults, model, camera, options}: the shader's defaults, and what is to be seen of which model.
const SHADINGS = ["phong", "normal", "depth", "steps", "texture", "data"];
const LOOP_LIMIT = 65535; // iterations after which Mesa's llvmpipe stops a fragment, silently

// Uniform -> number or list of numbers, for sample k of a picture of [width, height] pixels.
// loops: of the shader's functions, where its driver limits them; else null.
export function uniforms({defaults, model, camera, options}, loops, [width, height], k = 0) {
    const [level, normalLevel] = [options.level, options.normalLevel ?? options.level]
        .map((each) => Math.min(each, model.levels.length));
    const {steps, rounds} = fitting(loops, level, normalLevel, stepsOf(model, options), defaults.rounds[0]);
    return {
        resolution: [width, height], jitter: jitter(k), camera: matrix(camera, width / height), focal: [FOCAL],
        level, normal_level: normalLevel, iterations: steps, rounds, delta: model.levels.map(({delta}) => delta),
        step_scale: defaults.step_scale, shading: SHADINGS.indexOf(options.shading), light: options.light,
        background_bottom: options.background[0], background_top: options.background[1], time: [options.time],
    };
}

// A scene with some options changed.
export function asked(scene, options) {
    return {...scene, options: {...scene.options, ...options}};
}

// Steps that a ray makes at each level, per round.
export function stepsOf(model, options) {
    return model.levels.map(({iterations}) => Math.max(1, Math.round(iterations * options.iterations)));
}

// Steps and rounds, at most those wanted, that llvmpipe draws whole (as viewer/draw/options.py does).
function fitting(loops, level, normalLevel, steps, rounds) {
    if (!loops) return {steps, rounds};
    const once = 1 + loops.gradient[normalLevel - 1] + loops.texture;
    const round = () => steps.slice(0, level).reduce((sum, count, i) => sum + 2 + count * (1 + loops.value[i]), 2);
    const worst = () => rounds * round() + once;
    if (worst() > LOOP_LIMIT) steps = steps.map((count, i) => (i === level - 1 ? Math.min(count, 3) : count));
    while (rounds > 1 && worst() > LOOP_LIMIT) --rounds;
    return {steps, rounds};
}

// Offset of sample k of a pixel, in pixels: the first is its centre, the others a low-discrepancy sequence.
function jitter(k) {
    return k ? [(0.5 + k * 0.7548776662) % 1 - 0.5, (0.5 + k * 0.5698402910) % 1 - 0.5] : [0, 0];
}
