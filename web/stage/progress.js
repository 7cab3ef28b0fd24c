import {pause} from "../model/pause.js";
import {renderer} from "../view/view.js";
import {drawBoth, showPicture} from "./picture.js";

// What the visitor sees of a training: its line, and its live pictures.
const BETWEEN_PICTURES = 1000, BETWEEN_REPORTS = 200; // milliseconds
const PICTURES_SHARE = 0.2; // largest share of the time that pictures may take
const SLOW = 1.2; // times the planned seconds, from which a device is called slow
// Mean distances to a surface in radii of the shape, and mean angle in degrees, from which it is no likeness. Points with
// 3 % of noise lie 0.018 off a good surface, and their normals by 41 degrees.
const FAR = 0.015, FAR_CLOUD = 0.03, STEEP = 40;

// Returns {afterStep, tell} for trainShape. mine: the training of state.js; update: shows a line and a share; remember:
// called with a result when a level is finished.
export function follow(mine, settings, clock, end, update, remember) {
    const {live} = mine, count = settings.levels.length;
    const names = [...settings.levels.map((_, i) => `Level ${i + 1} of ${count}`), "Colors"];
    let reportedAt = 0, finished = 0, share = 0;
    const tell = (stage, doing) => update(`${names[stage]} · ${doing}`, share);
    const lineOf = ({stage, steps, least, isLate, left, meanF, levels}) => {
        const accuracy = stage < count ? meanF : levels.at(-1).meanF, total = clock() + left;
        const isSlow = !settings.steps && total > SLOW * end;
        return [
            `mean |f| ${accuracy.toExponential(1)}`,
            ...(isLate ? [`finishing: ${steps} of ${least} steps`] : []),
            `${Math.max(1, Math.ceil(left))} s left`,
            ...(isSlow ? [`this device is slow: about ${Math.ceil(total)} s instead of ${settings.seconds}`] : []),
        ].join(" · ");
    };
    const afterStep = async (step) => {
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

// Returns {isFar, line}: whether the surface of a result is no likeness of the shape, and what the page says of it.
export function judged({levels, seconds}, isCloud) {
    const {meanF, distance = meanF, angle} = levels.at(-1), time = `${Math.round(seconds)} s`;
    const isFar = isCloud ? distance > FAR_CLOUD : distance > FAR || angle > STEEP;
    const figures = `off by ${distance.toExponential(1)} of the radius · normals by ${angle.toFixed(1)}°`;
    return {
        isFar,
        line: isFar ?
            `The shape is not learned yet: ${figures} after ${time}. Train longer, or with a larger size`
            : `Trained in ${time} · ${figures}`,
    };
}
