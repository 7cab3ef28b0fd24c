import {DISTANCE, NORMAL, SAMPLE, VALUE} from "../kernel/kernel.js";
import {LACK} from "../model/constants.js";
import {bare, filtered, join} from "./sampling.js";
/** @import {TrainingShape} from "../shape/surface.js" */

// Hard-example mining: samples off the surface where the level under training is badly wrong (trainer/mining.py, without
// its thin features).

/** delta: of the level before, or of level 1's shell; near: distance from the surface below which f may exceed the
 * distance; addFrozen: adds the levels before to rows, infinite outside their bands; addLevel: adds the level under
 * training. @typedef {{isFirst: boolean, delta: number, near: number, addFrozen: (rows: Float32Array) => void,
 *     addLevel: (rows: Float32Array) => void}} MinedLevel */

/** Returns hard samples, with value and gradient of the levels before, and with their distances.
 * @param {TrainingShape} shape @param {MinedLevel} level
 * @param {Float32Array} earlier hard samples of the last time, may be empty
 * @param {number} count most candidates of each kind @param {Pick<Config, "sampling" | "mining">} config
 * @param {() => number} random */
export function hardSamples(shape, level, earlier, count, {sampling, mining}, random) {
    const {isFirst, delta, near, addFrozen, addLevel} = level, {excess} = mining;
    /** @param {Float32Array} rows @param {number} reach */
    const shifted = (rows, reach) => {
        for (let at = 0; at < rows.length; at += SAMPLE)
            for (let k = 0; k < 3; ++k) rows[at + k] += (2 * random() - 1) * reach;
        return rows;
    };
    const close = shifted(bare(shape.surface(count, random)), (isFirst ? mining.first_reach : 2) * delta);
    const anywhere = shifted(new Float32Array(isFirst ? 0 : SAMPLE * count), 1);
    const around = earlier.slice(0, SAMPLE * Math.floor(count / 4));
    for (let at = 0; at < around.length; at += SAMPLE) around.fill(0, at + VALUE, at + SAMPLE);
    const drawn = join(join(shifted(around, 2 * mining.spread * delta), close), anywhere);
    addFrozen(drawn);
    const rows = filtered(drawn, (at) => isFirst || Math.abs(drawn[at + VALUE]) < delta), trained = rows.slice();
    addLevel(trained);
    for (let at = 0; at < rows.length; at += SAMPLE) rows[at + DISTANCE] = trained[at + VALUE]; // for now
    const suspects = filtered(rows, (at) => {
        const size = Math.abs(rows[at + DISTANCE]);
        return (size > near && (isFirst || size > excess * Math.abs(rows[at + VALUE]))) ||
            (!isFirst && size < mining.near * delta);
    });
    const values = suspects.filter((_, i) => i % SAMPLE === DISTANCE);
    const most = isFirst ? Infinity : sampling.largest_distance * delta;
    shape.setDistances(suspects);
    return filtered(suspects, (at) => {
        const f = values[at / SAMPLE], distance = suspects[at + DISTANCE], size = Math.abs(distance);
        suspects[at + NORMAL] = 1; // marks a hard sample for the kernel
        suspects[at + DISTANCE] = Math.min(most, Math.max(-most, distance));
        return (Math.abs(f) > excess * size && size > near)
            || (!isFirst && f * Math.sign(distance) < LACK * size && size > mining.least_distance * delta)
            || (!isFirst && shape.isExact && f * distance < 0 && size > mining.wrong_sign);
    });
}
