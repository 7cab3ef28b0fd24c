import {probes} from "../print/reference.js";
import {element, root, say, setState} from "./messages.js";

// After a lost WebGL context. A model with a finished picture comes back unchanged. A model that made the driver fail
// comes back with half of its levels, repeatedly, down to level 1. After that, for a scene, after many losses in short
// time, and if no context comes back, the poster stays.
const WAIT = 12000; // milliseconds until the page reports that the context stays lost
const MOST_LOSSES = 5, SPAN = 60000; // losses within so many milliseconds after which the model comes back
let waiting = 0, losses = 0;

/** Returns what to show after the context is restored, or null. current: see current_model.js. variant: the last
 * variant, or null.
 * @param {Current} current @param {Variant | null} variant */
export function afterLoss(current, variant) {
    const {model: {levels}, memory} = current, isTrial = memory.read() === "trying";
    memory.interrupted("texture");
    setTimeout(() => {
        --losses;
    }, SPAN);
    if (++losses > MOST_LOSSES) return null;
    if (isTrial || variant?.proven) return current;
    if (variant?.storage === "literal") {
        memory.write("texture");
        return current;
    }
    if (current.model.field || levels.length === 1) return null;
    memory.levels = Math.ceil(levels.length / 2);
    return reduced(current);
}

/** Limits a model to the number of levels in its memory. @param {Current} current @returns {Current} */
export function reduced(current) {
    const whole = current.whole ?? current, {levels} = whole.model, count = current.memory.levels;
    if (count >= levels.length) return current;
    const left = levels.slice(count).flatMap(({network}) => network);
    const parameters = left.reduce((sum, {weight, bias}) => sum - weight.length - bias.length, whole.model.parameters);
    const model = {...whole.model, levels: levels.slice(0, count), parameters};
    return {...whole, whole, model, probes: probes(model), storage: "texture"};
}

/** Reports the lost context, and after a while that it stays lost. next: from afterLoss.
 * @param {Current | null} next */
export function reportLoss(next) {
    const poster = element("poster"), hasPoster = poster && !poster.hidden;
    const picture = "you see the picture that travels in the page";
    const giveUp = (/** @type {string} */ text) => {
        setState("failed", "");
        say(`${text} ${hasPoster ? `Now ${picture}. ` : ""}Reload the page to try again.`, false);
    };
    delete root.dataset.drawn;
    if (poster) poster.style.transform = "";
    clearTimeout(waiting);
    if (losses > MOST_LOSSES) return giveUp("The graphics driver was reset again and again.");
    if (!next) return giveUp("The graphics driver fails at this model, even at its first level alone.");
    setState("lost", "The graphics driver was reset");
    const meanwhile = hasPoster ? `; until then ${picture}` : "";
    say(`The graphics driver was reset. The model comes back when the driver does${meanwhile}.`, false);
    waiting = setTimeout(() => giveUp("The graphics driver was reset and did not come back."), WAIT);
}

/** Reports levels that were removed, or hides the message. @param {Current} current */
export function reportRestored({model, whole}) {
    clearTimeout(waiting);
    const count = model.levels.length;
    say(
        whole ?
            `The graphics driver failed at the ${whole.model.levels.length} levels of this model. `
            + `Here ${count === 1 ? "is the first" : `are the first ${count}`}.` :
            "",
    );
}
