import {shared} from "../model/facts.js";
import {declareLiterals, straight} from "./literal.js";
import {lowered, widest} from "./lower_model.js";
import {countLoops, layOut, looped, READERS} from "./texels.js";

// Prints the field's GLSL of any model, byte for byte as codegen/printers/field.py (tests/web/test_page_printer.py).

/** Returns the text of field(), field_gradient() and albedo(), and the texture of weights. A scene comes with its
 * field, printed by Python (web/scene.py). storage: "texture", "literal", or "auto": for each function the first
 * storage that holds its width. unroll: largest number of 4 x 4 products in one loop iteration.
 * @param {Model} model @param {string} storage @returns {PrintedField} */
export function printField(model, storage, unroll = shared.unroll) {
    if (model.field) return model.field;
    const {constants, values, gradients, texture} = lowered(model);
    const functions = [...values, ...gradients, ...(texture ? [texture] : [])];
    const isLiteral = (/** @type {Code} */ code) => storageOf(code, storage) === "literal";
    const inTexture = functions.filter((code) => !isLiteral(code));
    const {offsets, texels, height} = layOut(inTexture, constants);
    const parts = [[...declareLiterals(functions.filter(isLiteral), constants), ...(inTexture.length ? READERS : [])]];
    for (const code of functions)
        parts.push(printFunction(code, isLiteral(code) ? straight(code) : looped(code, offsets, unroll)));
    const input = `vec4(p, ${model.inputs === "xyzt" ? "time" : "1."})`;
    parts.push(printValue(values, input), printGradient(gradients, input), printAlbedo(texture, input));
    const upTo = (/** @type {Code[]} */ list) => {
        let total = 0;
        return list.map((code) => (total += isLiteral(code) ? 0 : countLoops(code, unroll)));
    };
    const loops = {value: upTo(values), gradient: upTo(gradients), texture: texture ? upTo([texture])[0] : 0};
    return {text: parts.map((lines) => `${lines.join("\n")}\n`).join("\n"), texels, height, loops};
}

/** @param {Code} code @param {string} storage */
function storageOf(code, storage) {
    return storage === "auto" ? shared.storages.find(([limit]) => widest(code) <= limit)?.[1] : storage;
}

/** @param {{name: string, outputs: string[]}} code @param {string[]} body */
export function printFunction({name, outputs}, body) {
    const [type, result] = [
        ["float", outputs[0]],
        ["vec4", `vec4(${outputs[0]}.xyz, ${outputs[1]})`],
        ["vec3", `vec3(${outputs.join(", ")})`],
    ][outputs.length - 1];
    return [`${type} ${name}(vec4 p) {`, ...body.map((line) => `    ${line}`), `    return ${result};`, "}"];
}

/** @param {Code[]} functions @param {string} input */
function printValue([first, ...others], input) {
    const deeper = others.flatMap(({name}, k) => [
        `    if (reached == ${k + 1} && level > ${k + 1} && abs(f) < delta[${k}]) {`,
        `        f += ${name}(q);`,
        `        reached = ${k + 2};`,
        "    }",
    ]);
    return [
        "float field(vec3 p, int level, out int reached) {",
        `    vec4 q = ${input};`,
        `    float f = ${first.name}(q);`,
        "    reached = 1;",
        ...deeper,
        "    return f;",
        "}",
    ];
}

/** @param {Code[]} functions @param {string} input */
function printGradient([first, ...others], input) {
    const deeper = others.flatMap(({name}, k) => [
        `    if (level > ${k + 1}) g += ${name}(q);`,
        `    if (reached == ${k + 1} && level > ${k + 1} && abs(f) < delta[${k}]) {`,
        "        f = g.w;",
        `        reached = ${k + 2};`,
        "    }",
    ]);
    return [
        "vec4 field_gradient(vec3 p, int level, out float f, out int reached) {",
        `    vec4 q = ${input};`,
        `    vec4 g = ${first.name}(q);`,
        "    f = g.w;",
        "    reached = 1;",
        ...deeper,
        "    return g;",
        "}",
        "",
        "vec4 field_gradient(vec3 p, int level) {",
        "    float f;",
        "    int reached;",
        "    return field_gradient(p, level, f, reached);",
        "}",
    ];
}

/** @param {Code | null} texture @param {string} input */
function printAlbedo(texture, input) {
    const color = texture ? `clamp(${texture.name}(${input}), 0., 1.)` : `vec3(${shared.plain})`;
    return ["vec3 albedo(vec3 p) {", `    return ${color};`, "}"];
}
