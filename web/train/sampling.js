import {DISTANCE, SAMPLE, VALUE} from "../kernel/kernel.js";
import {TrainingError} from "../kernel/training_error.js";
import {placeOf} from "../shape/shape.js";
/** @import {TrainingShape} from "../shape/surface.js" */

// The samples of a level (trainer/training_samples.py). Columns of a sample: kernel/siren.c.

/** Adds value and gradient of the levels before to rows. @typedef {(rows: Float32Array) => void} AddField */

/** Draws samples of level 1's domain: in a shell around the surface, in the corners of the cube, and in the ball.
 * @param {TrainingShape} shape @param {number} count @param {SamplingConfig} config @param {() => number} random */
export function domainSamples(shape, count, config, random) {
    const shell = Math.floor(count * config.first_band_share), corners = Math.floor(count * config.corner_share);
    const rows = new Float32Array(SAMPLE * count), within = (/** @type {number} */ reach) => (2 * random() - 1) * reach;
    rows.set(bare(shape.surface(shell, random)));
    for (let i = 0; i < count; ++i) {
        const at = SAMPLE * i;
        if (i < shell) {
            for (let k = 0; k < 3; ++k) rows[at + k] += within(config.first_band);
            continue;
        }
        const isCorner = i < shell + corners, reach = isCorner ? 1 : config.ball_radius;
        do for (let k = 0; k < 3; ++k) rows[at + k] = within(reach); while (
            isCorner === Math.hypot(rows[at], rows[at + 1], rows[at + 2]) <= config.ball_radius
        );
    }
    shape.setDistances(rows);
    return rows;
}

/** Draws samples of the band |f| < delta of the levels before, with their distances. See bandPoints.
 * @param {TrainingShape} shape @param {number} count @param {number} delta @param {AddField} addField
 * @param {Float32Array} strays @param {SamplingConfig} config @param {() => number} random */
export function bandSamples(shape, count, delta, addField, strays, config, random) {
    const kept = bandPoints(shape, count, delta, addField, strays, random), most = config.largest_distance * delta;
    shape.setDistances(kept);
    for (let at = DISTANCE; at < kept.length; at += SAMPLE) kept[at] = Math.min(most, Math.max(-most, kept[at]));
    return kept;
}

/** Draws points of the band by dithering surface points and strays (Fig. 3a), with value and gradient of the levels
 * before. @param {TrainingShape} shape @param {number} count @param {number} delta @param {AddField} addField
 * @param {Float32Array} strays rows, may be empty @param {() => number} random */
export function bandPoints(shape, count, delta, addField, strays, random) {
    const kept = new Float32Array(SAMPLE * count), seeds = join(bare(shape.surface(count, random)), strays);
    let have = 0, tried = 0;
    while (have < count) {
        const drawn = new Float32Array(SAMPLE * Math.max(4 * (count - have), 1024));
        for (let at = 0; at < drawn.length; at += SAMPLE) {
            const from = SAMPLE * Math.floor(random() * (seeds.length / SAMPLE));
            for (let k = 0; k < 3; ++k) drawn[at + k] = seeds[from + k] + (2 * random() - 1) * 2 * delta;
        }
        addField(drawn);
        for (let at = 0; at < drawn.length && have < count; at += SAMPLE) {
            if (Math.abs(drawn[at + VALUE]) < delta) kept.set(drawn.subarray(at, at + SAMPLE), SAMPLE * have++);
        }
        tried += drawn.length / SAMPLE;
        if (tried > 800 * count) throw new TrainingError("the level before missed the surface");
    }
    return kept;
}

/** Finds points of the band where the levels before are wrong, likelier where the error is larger (find_strays). share:
 * of the search that this worker does.
 * @param {TrainingShape} shape @param {number} delta @param {AddField} addField @param {number} count
 * @param {number} share @param {SamplingConfig} config @param {() => number} random */
export function findStrays(shape, delta, addField, count, share, config, random) {
    const drawn = new Float32Array(SAMPLE * Math.floor(config.stray_candidates * share));
    for (let at = 0; at < drawn.length; at += SAMPLE) for (let k = 0; k < 3; ++k) drawn[at + k] = 2 * random() - 1;
    addField(drawn);
    const suspects = filtered(drawn, (at) => Math.abs(drawn[at + VALUE]) < delta)
        .slice(0, SAMPLE * Math.floor(config.stray_suspects * share));
    shape.setDistances(suspects);
    const error = (/** @type {number} */ at) => Math.abs(suspects[at + DISTANCE] - suspects[at + VALUE]);
    const wrong = filtered(suspects, (at) => error(at) > config.stray_error * delta);
    const weights = new Float64Array(wrong.length / SAMPLE); // cumulative
    let sum = 0;
    for (let i = 0; i < weights.length; ++i) {
        weights[i] = sum += (wrong[SAMPLE * i + DISTANCE] - wrong[SAMPLE * i + VALUE]) ** 2;
    }
    const strays = new Float32Array(weights.length ? SAMPLE * count : 0);
    for (let at = 0; at < strays.length; at += SAMPLE) {
        const from = SAMPLE * placeOf(weights, random() * sum);
        strays.set(wrong.subarray(from, from + 3), at);
    }
    return strays;
}

/** Returns rows without their normals. @param {Float32Array} rows */
export function bare(rows) {
    for (let at = 0; at < rows.length; at += SAMPLE) rows.fill(0, at + DISTANCE + 1, at + SAMPLE);
    return rows;
}

/** @param {Float32Array} one @param {Float32Array} other */
export function join(one, other) {
    const whole = new Float32Array(one.length + other.length);
    whole.set(one);
    whole.set(other, one.length);
    return whole;
}

/** Returns the rows that a condition on their first place keeps.
 * @param {Float32Array} rows @param {(at: number) => unknown} keep */
export function filtered(rows, keep) {
    const kept = new Float32Array(rows.length);
    let end = 0;
    for (let at = 0; at < rows.length; at += SAMPLE) {
        if (!keep(at)) continue;
        kept.set(rows.subarray(at, at + SAMPLE), end);
        end += SAMPLE;
    }
    return kept.slice(0, end);
}
