import {DELTA_FACTOR, SOFTBOX_SHARE, WIDEST} from "../model/constants.js";
import {shared} from "../model/facts.js";
import {withDigits} from "../model/quantize.js";
import {ModelError} from "../model/safetensors.js";
import {number} from "./cstyle.js";
import {decimalLines, fewestDigits} from "./decimals.js";
import {fewestBits} from "./few_bits.js";
import {headerLine, pythonJson} from "./header.js";
import {lowered} from "./lower_model.js";
import {packedLines} from "./packed.js";

// Prints the text of Shadertoy's Image tab, byte for byte as codegen/targets/shadertoy.py for quantized and for moving
// models, but with one width for each band, and with a ball around the shape. The page has glsl/functions/shadertoy.glsl, without
// spaces and comments, in an element (text_elements() of web/page.py).
const SOFTBOX_LINES = /^#ifdef SOFTBOX\n([^]*?)(?:^#else\n([^]*?))?^#endif\n/gm;

/** Resolves to the text. sha256: of hashOf(). shade: "softbox", "phong", or null for the softbox where it adds little.
 * Throws a ModelError for too wide a model.
 * @param {ShownModel} model @param {string} sha256 @param {string | null} shade */
export async function shadertoyText(model, sha256, shade = null) {
    const widest = widestOf(model);
    if (widest > WIDEST) throw new ModelError(`a layer is ${widest} wide, and browsers compile ${WIDEST} at most`);
    // A single level's network is the field.
    const nameOf = (/** @type {string} */ name) => (model.levels.length === 1 && name === "network1" ? "field" : name);
    const rounded = model.inputs === "xyz" ? await fewestBits(model) : null;
    if (!rounded) return textOf(model, sha256, shade, decimalLines(model, await fewestDigits(model), nameOf));
    const {values, texture, constants} = lowered(rounded.model);
    const functions = [...values, ...(texture ? [texture] : [])].map((code) => ({...code, name: nameOf(code.name)}));
    const error = rounded.error && Object.entries(rounded.error).map(([key, value]) => [key, withDigits(value, 2)]);
    const further = error ? {error: Object.fromEntries(error)} : {};
    return textOf(model, sha256, shade, packedLines(functions, constants), further);
}

/** @param {Model} model */
function widestOf({levels, texture}) {
    const networks = [...levels.map(({network}) => network), ...(texture ? [texture] : [])];
    return Math.max(...networks.flat().map(({rows}) => rows));
}

/** Whether Shadertoy takes a model: one that has networks, which a scene has not, and none that are too wide.
 * @param {Model} model */
export const fitsShadertoy = (model) => !model.field && widestOf(model) <= WIDEST;

/** Returns the text. weights: the lines of the weights and networks; further: facts for the header.
 * @param {ShownModel} model @param {string} sha256 @param {string | null} shade @param {string[]} weights
 * @param {object} [further] */
function textOf(model, sha256, shade, weights, further) {
    const by = model.credit ? `, by ${pythonJson(model.credit)}` : "";
    const floor = `const float G = ${number(Math.round(model.ground * 1e4) / 1e4)}`;
    const text = (/** @type {boolean} */ softbox) =>
        [
            headerLine(model, "shadertoy", sha256, further),
            `// ${pythonJson(model.name)}${by}`,
            "// as a neural signed distance function, made with mplicits. Drag to orbit; edit the settings below.",
            ...settingsOf(model, softbox).map((setting) => `#define ${setting}`),
            squeezedGlsl([
                model.levels.length > 1 ? "int k = -1, J;" : "int k = -1;",
                ...(softbox ? [`${floor}, Y = ${shortNumber(model.levels[0].delta)};`] : []),
                ...weights,
                ...fieldLines(model, softbox),
                mainOf(model, softbox),
            ].join("\n")),
        ].join("\n");
    const plain = text(false), lit = shade === "phong" ? "" : text(true);
    return shade === "softbox" || (lit && lit.length <= (1 + SOFTBOX_SHARE) * plain.length) ? lit : plain;
}

/** @param {Model} model @param {boolean} softbox */
function settingsOf({front, inputs, levels, texture}, softbox) {
    const {camera: {azimuth, elevation}, defaults, plain} = shared;
    const vector = (/** @type {Vector} */ values) => `vec${values.length}(${values.map(shortNumber).join(", ")})`;
    return [
        `VIEW ${vector(front ?? [azimuth, elevation])} // initial azimuth and elevation, degrees`,
        "SPEED .3 // speed of the turntable, radians per second",
        `LIGHT ${vector(defaults.light)} // direction to the light: right, up, back`,
        texture ? "COLOR(c) c // color of the surface, sRGB; c: the model's" : `COLOR vec3(${plain}) // sRGB`,
        `BOTTOM ${vector(defaults.background_bottom)} // background, sRGB`,
        `TOP ${vector(defaults.background_top)}`,
        ...(inputs === "xyzt" ? ["TIME (.5 - .5 * cos(iTime)) // time of the motion, from 0 to 1 and back"] : []),
        ...(softbox ? ["SOFTBOX 1 // a floor, soft shadows, sky light; 0: Phong"] : []),
        ...(levels.length > 1 ? [`LEVEL ${levels.length} // finest level, from 1`] : []),
        "STEPS 200 // most evaluations of the field on a ray",
        "AA 1 // 2: 2 x 2 samples per pixel",
    ];
}

/** Returns field() up to LEVEL (Eq. 3): outside of a band, the distance to the band's offset surface. Taps of a
 * normal take the levels of the ray's end point.
 * @param {Model} model @param {boolean} softbox */
function fieldLines({levels}, softbox) {
    if (levels.length === 1) return [];
    const deeper = levels.slice(0, -1).flatMap(({delta}, i) => [
        `#if LEVEL >= ${i + 2}`,
        `if (k < 0) J = abs(f) > ${shortNumber(delta)} ? ${i + 1} : 9;`,
        `if (J < ${i + 2}) return f - ${shortNumber(delta / DELTA_FACTOR)};`,
        `f += network${i + 2}(p);`,
        "#endif",
    ]);
    return [
        "float field(vec4 p) {",
        "float f = network1(p);",
        ...(softbox ? ["if (k > 3) return f;"] : []),
        ...deeper,
        "return f;",
        "}",
    ];
}

/** @param {Model} model @param {boolean} softbox */
function mainOf({inputs, levels, texture}, softbox) {
    const time = inputs === "xyzt" ? "TIME" : "1", bounds = levels.map((level) => level.bounds.band_step_bound);
    bounds[levels.length - 1] = levels.at(-1).bounds.step_bound;
    const bound = Math.floor(100 * Math.min(...bounds, 1) + 1e-6) / 100;
    const albedo = texture ? `clamp(COLOR(network_texture(vec4(3.52*m[2]+t*v,${time}))),0.,1.)` : "COLOR";
    return document.getElementById("shadertoy.glsl").textContent
        .replace(SOFTBOX_LINES, (_, lit, plain = "") => (softbox ? lit : plain))
        .replace(",1));", `,${time}));`).replace("ALBEDO", albedo)
        .replace("f*=BOUND;\n", bound === 1 ? "" : `f*=${number(bound)};\n`);
}

const shortNumber = (/** @type {number} */ value) => number(withDigits(value, 3));

/** Returns GLSL without indentation, comments and spaces around operators. @param {string} text */
function squeezedGlsl(text) {
    return text.replace(/^\s+|\s*\/\/.*$/gm, "").replace(/ *([-+*/=<>,;(){}?:&|]) */g, "$1");
}
