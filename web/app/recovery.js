import {element, enter, root, say} from "./messages.js";
import {probes} from "./reference.js";

// What becomes of the picture when the driver loses the WebGL context, and with it all that was drawn. A model whose
// picture was whole before comes back as it was. One that the driver failed at comes back with half of its levels, and
// half of these, down to level 1; after that, of a scene, and where no context comes back, the page's poster stays.
const WAIT = 12000; // milliseconds after which a context that is not back will hardly come
let waiting = 0;

// Returns what to show when the context is back; null where nothing is left to be tried. shown: as shown.js describes
// it. variant: what was drawn with, as variants.js describes it; null before there was one.
export function afterLoss(shown, variant) {
    const {model: {levels}, memory} = shown, isTrial = memory.read() === "trying";
    memory.interrupted("texture");
    if (isTrial || variant?.proven) return shown;
    if (variant?.storage === "literal") {
        memory.write("texture");
        return shown;
    }
    if (shown.model.field || levels.length === 1) return null;
    memory.levels = Math.ceil(levels.length / 2);
    return reduced(shown);
}

// Returns what is shown with as many levels as its memory holds possible.
export function reduced(shown) {
    const whole = shown.whole ?? shown, {levels} = whole.model, count = shown.memory.levels;
    if (count >= levels.length) return shown;
    const left = levels.slice(count).flatMap(({network}) => network);
    const parameters = left.reduce((sum, {weight, bias}) => sum - weight.length - bias.length, whole.model.parameters);
    const model = {...whole.model, levels: levels.slice(0, count), parameters};
    return {...whole, whole, model, probes: probes(model), storage: "texture"};
}

// Tells the visitor that the context is lost, and later whether it stays so. next: what afterLoss gave.
export function tellLost(next) {
    const poster = element("poster"), hasPoster = poster && !poster.hidden;
    const picture = "you see the picture that travels in the page";
    const giveUp = (text) => {
        enter("failed", "");
        say(`${text} ${hasPoster ? `Now ${picture}. ` : ""}Reload the page to try again.`, false);
    };
    delete root.dataset.drawn;
    clearTimeout(waiting);
    if (!next) return giveUp("The graphics driver fails at this model, even at its first level alone.");
    enter("lost", "The graphics driver was reset");
    const meanwhile = hasPoster ? `; until then ${picture}` : "";
    say(`The graphics driver was reset. The model comes back when the driver does${meanwhile}.`, false);
    waiting = setTimeout(() => giveUp("The graphics driver was reset and did not come back."), WAIT);
}

// Tells the visitor that the context is back, or, where levels are left out, that they are.
export function tellBack({model, whole}) {
    clearTimeout(waiting);
    const count = model.levels.length;
    say(whole ? `The graphics driver failed at the ${whole.model.levels.length} levels of this model. `
        + `Here ${count === 1 ? "is the first" : `are the first ${count}`}.` : "");
}
