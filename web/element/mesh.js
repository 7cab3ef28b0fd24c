import {Device} from "../draw/device.js";
import {fitting} from "../draw/uniforms.js";
import {facts, shared} from "../model/facts.js";
import {printField} from "../print/field.js";
import {TEXTURE_WIDTH} from "../print/texels.js";
import {lightsOf, MOST_LIGHTS} from "./lights.js";
import {ownModel} from "./models.js";
import {castRay} from "./rays.js";

// A model in a scene of three.js: a box whose fragments trace rays, with the model's depth. It works with every release
// that has WebGL 2: what differs between them is asked of THREE and of the renderer, never of the release's number.
/** @type {{unroll: number, limitsLoops: boolean} | null} */ let driver = null;
let isRefused = false; // whether a line about the renderer is on the console

/** Returns an object for a scene. THREE: the library. options: {model: of loadModel, by default this module's; color:
 * of a model without a texture, a number or a THREE.Color; level; time}. The object has model space's coordinates:
 * the shape fits the unit sphere, y up. It has `level`, `time` and dispose().
 * @param {Three} THREE @param {{model?: ShownModel, color?: unknown, level?: number, time?: number}} options */
export function createMesh(THREE, options = {}) {
    const {model = ownModel(), color = 0xccbda8, level = model.levels.length, time = 0} = options;
    const {unroll, limitsLoops} = driver ?? (driver = knownDriver());
    const {text, texels, height, loops} = printField(model, "texture", unroll);
    const weights = new THREE.DataTexture(texels, TEXTURE_WIDTH, height, THREE.RGBAFormat, THREE.FloatType);
    weights.needsUpdate = true;
    const steps = model.levels.map(({iterations}) => iterations), last = model.levels.length;
    const fit = fitting(limitsLoops ? loops : null, last, last, steps, shared.defaults.rounds[0]);
    const values = {
        weights,
        level,
        time,
        iterations: fit.steps,
        rounds: fit.rounds,
        delta: model.levels.map(({delta}) => delta),
        step_bound: model.levels.map(({bounds}) => bounds.step_bound),
        band_step_bound: model.levels.map(({bounds}) => bounds.band_step_bound),
        plain: new THREE.Color(color),
        linearized: false,
        ...lightsOf(THREE, null),
    };
    /** @type {Record<string, {value: unknown}>} */
    const uniforms = Object.fromEntries(Object.entries(values).map(([name, value]) => [name, {value}]));
    const vertexShader = plainText("hull.vert.glsl");
    const material = (/** @type {string} */ name, more = {}) =>
        new THREE.ShaderMaterial({
            vertexShader,
            fragmentShader: fragmentText(model, text, name, THREE),
            uniforms,
            side: THREE.BackSide,
            ...more,
        });
    const side = 2 * (1 + model.levels[last - 1].delta);
    const mesh = new THREE.Mesh(new THREE.BoxGeometry(side, side, side), material("hull_color.frag.glsl"));
    mesh.material.shadowSide = THREE.BackSide;
    mesh.customDepthMaterial = material("hull_depth.frag.glsl");
    mesh.name = model.name;
    mesh.onBeforeRender = (/** @type {Three} */ renderer, /** @type {Three} */ scene) => {
        if (renderer.capabilities?.isWebGL2 === false || renderer.isWebGPURenderer) return decline(mesh);
        const isManaged = THREE.ColorManagement?.enabled ||
            renderer.outputEncoding === THREE.sRGBEncoding && THREE.sRGBEncoding;
        for (
            const [name, value] of Object.entries({...lightsOf(THREE, scene, renderer), linearized: Boolean(isManaged)})
        )
            uniforms[name].value = value;
        mesh.material.uniformsNeedUpdate = true;
    };
    mesh.raycast = (/** @type {Three} */ caster, /** @type {object[]} */ hits) =>
        castRay(THREE, mesh, model, caster, hits);
    mesh.dispose = () =>
        [weights, mesh.geometry, mesh.material, mesh.customDepthMaterial].forEach((part) => part.dispose());
    for (const name of ["level", "time"])
        Object.defineProperty(mesh, name, {
            get: () => uniforms[name].value,
            set: (value) => (uniforms[name].value = value),
        });
    return mesh;
}

/** Hides a mesh that the renderer cannot draw; the rest of the scene stays. @param {Three} mesh */
function decline(mesh) {
    mesh.visible = false;
    if (isRefused) return;
    isRefused = true;
    console.error(
        "createMesh needs a THREE.WebGLRenderer with WebGL 2: before release 118, its option "
            + '{canvas, context: canvas.getContext("webgl2")}',
    );
}

// Asks a context, which is given back at once.
function knownDriver() {
    const device = new Device(document.createElement("canvas")), {unroll, limitsLoops} = device;
    device.gl.getExtension("WEBGL_lose_context")?.loseContext();
    return {unroll, limitsLoops};
}

/** Returns a file of glsl/ with its includes; those of three.js in <> stay. @param {string} name @returns {string} */
function plainText(name, seen = new Set()) {
    if (seen.has(name)) return "";
    seen.add(name);
    return facts.shaders[name].replace(/^#include "(.*)"\n/gm, (_, other) => plainText(other, seen));
}

/** @param {Model} model @param {string} field @param {string} name @param {Three} THREE */
function fragmentText(model, field, name, THREE) {
    const colors = THREE.ShaderChunk.colorspace_fragment ? "colorspace_fragment" : "encodings_fragment";
    const seen = new Set();
    return `precision highp sampler2D;
const int LEVELS = ${model.levels.length}, LIGHTS = ${MOST_LIGHTS};
const float STEP_SCALE = ${shared.defaults.step_scale[0].toFixed(6)};
uniform int level, rounds, iterations[LEVELS];
uniform float time, delta[LEVELS], step_bound[LEVELS], band_step_bound[LEVELS];
uniform sampler2D weights;
${model.texture ? "#define TEXTURED\n" : ""}${
        ["sine.glsl", "half_width.glsl"].map((file) => plainText(file, seen)).join("\n")
    }
${field}
${["skip.glsl", "march.glsl", "hull.frag.glsl", name].map((file) => plainText(file, seen)).join("\n")}`
        .replace("OUTPUT_COLORS", `#include <${colors}>`);
}
