import {pause} from "../model/pause.js";
import {renderer} from "../view/view.js";
import {drawBoth, showPicture} from "./picture.js";
/** @import {TrainingOptions, TrainingStep} from "../train/training.js" */
/** @import {Result, Training} from "./state.js" */

// What the visitor sees of a training: its line, and its live pictures.
const BETWEEN_PICTURES = 1000, BETWEEN_REPORTS = 200; // milliseconds
const PICTURES_SHARE = 0.2; // largest share of the time that pictures may take
const SLOW = 1.2; // times the planned seconds, from which a device is called slow
// Mean distances to a surface in radii of the shape, and mean angle in degrees, from which it is no likeness. Points with
// 3 % of noise lie 0.018 off a good surface, and their normals by 41 degrees.
const FAR = 0.015, FAR_CLOUD = 0.03, STEEP = 40;

/** Returns callbacks for trainShape. remember: called when a level is finished.
 * @param {Training} mine @param {Settings} settings @param {() => number} clock @param {number} end
 * @param {(line: string, share: number) => void} update shows a line and a share
 * @param {(result: Pick<Result, keyof Trained | "settings" | "seconds">) => void} remember
 * @returns {Pick<Required<TrainingOptions>, "afterStep" | "tell">} */
export function follow(mine, settings, clock, end, update, remember) {
    const {live} = mine, count = settings.levels.length;
    const names = [...settings.levels.map((_, i) => `Level ${i + 1} of ${count}`), "Colors"];
    let reportedAt = 0, finished = 0, share = 0;
    const tell = (/** @type {number} */ stage, /** @type {string} */ doing) =>
        update(`${names[stage]} · ${doing}`, share);
    const lineOf = (/** @type {TrainingStep} */ {stage, steps, least, isLate, left, meanF, levels}) => {
        const accuracy = stage < count ? meanF : levels[count - 1].meanF, total = clock() + left;
        const isSlow = !settings.steps && total > SLOW * end;
        return [
            `mean |f| ${accuracy.toExponential(1)}`,
            ...(isLate ? [`finishing: ${steps} of ${least} steps`] : []),
            `${Math.max(1, Math.ceil(left))} s left`,
            ...(isSlow ? [`this device is slow: about ${Math.ceil(total)} s instead of ${settings.seconds}`] : []),
        ].join(" · ");
    };
    const afterStep = async (/** @type {TrainingStep} */ step) => {
        const now = performance.now(), {levels, network, layout, weights} = step;
        share = step.done;
        if (now > reportedAt + BETWEEN_REPORTS) {
            tell(step.stage, lineOf(step));
            reportedAt = now;
        }
        if (levels.length > finished) {
            finished = levels.length;
            remember({levels: [...levels], texture: null, settings, seconds: clock()});
        }
        const wait = Math.max(BETWEEN_PICTURES, (renderer.refining?.frame ?? 0) / PICTURES_SHARE);
        if (live.isReady && now > live.drawnAt + wait && !document.hidden) {
            if (!mine.isSeen) drawBoth();
            await live.show({levels, unfinished: {network, layout, weights}});
        }
        if (!mine.isSeen && renderer.quicked >= live.since) {
            mine.isSeen = true;
            showPicture("field");
            live.drawnAt = 0; // the next picture ends the refinement of this one
        }
        while (mine.isPaused && !mine.isStopped) {
            const since = performance.now();
            await pause(50);
            mine.paused += (performance.now() - since) / 1000;
        }
        return mine.isStopped ? "stop" : "";
    };
    return {afterStep, tell};
}

/** Returns whether the surface of a result is no likeness of the shape, and what the page says of it.
 * @param {Pick<Result, "levels" | "seconds">} result @param {boolean} isCloud */
export function judged({levels, seconds}, isCloud) {
    const {meanF, distance = meanF, angle} = levels[levels.length - 1], time = `${Math.round(seconds)} s`;
    const isFar = isCloud ? distance > FAR_CLOUD : distance > FAR || angle > STEEP;
    const figures = `off by ${distance.toExponential(1)} of the radius · normals by ${angle.toFixed(1)}°`;
    return {
        isFar,
        line: isFar ?
            `The shape is not learned yet: ${figures} after ${time}. Train longer, or with a larger size`
            : `Trained in ${time} · ${figures}`,
    };
}
