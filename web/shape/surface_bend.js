import {NORMAL, SAMPLE} from "../kernel/kernel.js";
import {randomNumbers} from "../kernel/random.js";
import {BEND_SEED, FEWEST_BENDS} from "../model/constants.js";
/** @import {TrainingShape} from "./surface.js" */

const BENDS_AT = 400; // points whose neighbors are compared

/** Returns the bend of a shape (`bend_of` of trainer/suited_omegas.py): the median angle, degrees, between the normals
 * of neighboring surface points; infinity where there are too few.
 * @param {TrainingShape} shape @param {BendConfig} config */
export function bendOf(shape, {points, nearest, farthest}) {
    const rows = shape.surface(points, randomNumbers(BEND_SEED)), angles = [];
    for (let at = 0; at < SAMPLE * BENDS_AT; at += SAMPLE) {
        for (let to = 0; to < rows.length; to += SAMPLE) {
            const distance = Math.hypot(rows[at] - rows[to], rows[at + 1] - rows[to + 1], rows[at + 2] - rows[to + 2]);
            if (distance <= nearest || distance > farthest) continue;
            const one = at + NORMAL, other = to + NORMAL;
            const cosine = rows[one] * rows[other] + rows[one + 1] * rows[other + 1] + rows[one + 2] * rows[other + 2];
            if (cosine > 0) angles.push(Math.acos(Math.min(cosine, 1))); // on the same side
        }
    }
    if (angles.length < FEWEST_BENDS) return Infinity;
    return 180 / Math.PI * angles.sort((a, b) => a - b)[Math.floor(angles.length / 2)];
}
