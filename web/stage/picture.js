import {fillChoices} from "../view/controls.js";
import {element, root, setState} from "../view/messages.js";
import {drawWith, renderer} from "../view/view.js";
import {Axes} from "./axes.js";
import {Preview} from "./preview.js";
import {state} from "./state.js";
/** @import {PreviewBuffers} from "./preview_buffers.js" */
/** @import {FullState} from "./state.js" */

// The picture on the stage: the shape itself with the axes of its file, or its field.
let /** @type {Preview} */ preview, /** @type {Axes} */ axes;
/** @type {Drawer} */
const mesh = {
    show(camera, options) {
        preview.show(camera, options);
        axes.show(camera);
    },
};
/** @type {Drawer} */
const both = {
    show(camera, ...more) {
        mesh.show(camera, ...more);
        renderer.show(camera, ...more);
    },
};

// Compiles what showShape() needs, while workers read a shape.
export function preparePreview() {
    axes ??= new Axes(element("axes"));
    preview ??= new Preview(element("mesh"), (name) => renderer.painter.shader(name));
}

/** Shows a shape. @param {PreviewBuffers} corners */
export function showShape(corners) {
    preview.load(corners);
    turnTo(/** @type {FullState} */ (state).shape.up);
    showPicture("mesh");
}

// Lets the field be drawn behind the mesh, until showPicture() shows it.
export function drawBoth() {
    if ("preview" in root.dataset) drawWith(both);
}

/** Shows the "mesh" or the "field". @param {string} which */
export function showPicture(which) {
    const isMesh = which === "mesh";
    hidePreview(!isMesh);
    if (isMesh) {
        element("poster").hidden = true;
        root.dataset.drawn = "";
        setState("still", "");
    }
    drawWith(isMesh ? mesh : null);
    const choices = [{value: "mesh", label: preview.isCloud ? "Cloud" : "Mesh"}, {value: "field", label: "Field"}];
    fillChoices(element("picture"), choices, which, showPicture);
    const field = /** @type {HTMLInputElement} */ (element("picture").querySelector("[value=field]"));
    const {training, result} = state;
    field.disabled = isMesh && !(training ? training.isSeen : result);
    /** @type {HTMLElement} */ (field.parentElement).title = field.disabled ? "The field is not drawn yet" : "";
}

/** @param {boolean} isHidden */
function hidePreview(isHidden) {
    for (const id of ["mesh", "axes"]) element(id).toggleAttribute("hidden", isHidden);
    root.toggleAttribute("data-preview", !isHidden);
}

/** Turns the shape so that an axis of the file points up. @param {Up} up */
export function turnTo(up) {
    /** @type {FullState} */ (state).shape.up = preview.up = axes.up = up;
    element("up").textContent = `Up: ${up.toUpperCase().replace("-", "−")}`;
}
