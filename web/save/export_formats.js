import {facts} from "../model/facts.js";
import {functionText} from "../print/glsl_function.js";
import {hashOf} from "../print/header.js";
import {shadertoyText} from "../print/shadertoy.js";
import {loadTeam} from "../train/loading.js";
import {asQuestion} from "../train/training.js";
import {element} from "../view/messages.js";
import {renderer} from "../view/view.js";
import {canWritePage, pageText} from "./page_export.js";
import {posterOf} from "./poster.js";
import {tinyText} from "./tiny_export.js";
/** @import {Result, StageShape} from "../stage/state.js" */
/** @import {Kind} from "./export_buttons.js" */

/** Returns what a result can be saved as. @param {StageShape} shape @param {Result} result @param {ShownModel} model
 * @param {() => Promise<Blob>} video @returns {Kind[]} */
export function kindsOf(shape, result, model, video) {
    const hash = hashOf(result.bytes.buffer);
    /** @type {Promise<string> | null} */
    let text = null;
    const shadertoy = async () => (text ??= shadertoyText(model, await hash));
    const poster = () => renderer.device.unlessLost(posterOf(renderer, facts.shade));
    const page = async () => pageText(result.bytes, model.ground, facts.shade, await poster());
    const mesh = (/** @type {string} */ format) => async () => {
        await loadTeam(shape);
        const {bytes} = await shape.team.ask(0, "mesh", {
            format,
            levels: result.levels.map(asQuestion),
            texture: result.texture && asQuestion(/** @type {TrainedLevel} */ (result.texture)),
            triangles: Number(element("detail").value),
            place: {center: shape.center, scale: shape.scale},
        });
        return bytes;
    };
    /** @type {Kind[]} */
    const kinds = [
        {
            id: "download",
            label: "Model",
            ending: "safetensors",
            title: "For mplicits and for this page",
            make: () => result.bytes,
            isQuick: true,
        },
        {
            id: "save-page",
            label: "Web page",
            ending: "html",
            title: "One file that shows the shape anywhere",
            make: page,
        },
        {
            id: "save-tiny",
            label: "Tiny page",
            ending: "tiny.html",
            title: "The same in few bytes, without controls",
            make: async () => tinyText(model, await shadertoy()),
            isQuick: true,
        },
        {
            id: "save-text",
            label: "Shadertoy",
            ending: "frag",
            title: "Text for the Image tab of shadertoy.com",
            make: shadertoy,
            isQuick: true,
        },
        {
            id: "copy-text",
            label: "Copy Shadertoy",
            title: "The same text, to the clipboard",
            make: shadertoy,
            isCopied: true,
        },
        {
            id: "save-glsl",
            label: "GLSL",
            ending: "glsl",
            title: "Functions of the field for your shader",
            make: async () => functionText(model, await hash),
            isQuick: true,
        },
        {id: "save-ply", label: "PLY", ending: "ply", title: "A mesh of the field", make: mesh("ply"), isAnew: true},
        {id: "save-glb", label: "GLB", ending: "glb", title: "A mesh of the field", make: mesh("glb"), isAnew: true},
        {element: element("detail")},
        {id: "save-webm", label: "Video", ending: "webm", title: "One turn", make: video},
    ];
    return canWritePage ? kinds : kinds.filter(({id}) => id !== "save-page");
}
