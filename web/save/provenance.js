/** @import {Result, StageShape} from "../stage/state.js" */

/** Returns the record of a training for its model file, with the keys of `mplicits train`.
 * @param {StageShape} shape @param {Result} result */
export function provenanceOf({read: {name, facets}, crease}, {levels, texture, settings, seconds}) {
    /** @param {TrainedNetwork} network @param {number} omega */
    const recordOf = ({layout: {width, depth}, steps, share, restarts, loss, seconds: spent}, omega) => (
        {network: `${width}x${depth}`, omega, steps, fraction: share, restarts, loss, seconds: Number(spent.toFixed(3))}
    );
    const {meanF, distance = meanF, angle} = levels[levels.length - 1];
    return {
        made_by: "page",
        source: {file: name, ...(facets && crease !== null ? {crease} : {})},
        seed: settings.seed,
        seconds: Number(seconds.toFixed(3)),
        levels: levels.map((level, i) => (
            {...recordOf(level, settings.omegas[i]), mean_f: level.meanF, angle: level.angle}
        )),
        surface: {
            shape: {distance_mean: null, missing_mean: distance, normal_angle: angle, invented: null},
            flat: null,
            open: false,
        },
        texture: texture && recordOf(texture, settings.omegas[settings.levels.length]),
    };
}
