import {LONGEST_NAME, WIDEST_LITERAL} from "../model/constants.js";
import {facts, shared} from "../model/facts.js";
import {ModelError} from "../model/safetensors.js";
import {number} from "./cstyle.js";
import {printFunction} from "./field.js";
import {headerLine} from "./header.js";
import {declareLiterals, straight} from "./literal.js";
import {lowered, widest} from "./lower_model.js";

// Prints the distance function for GLSL and Godot, byte for byte as codegen/targets/glsl_function.py.
const SINES = /vec4 reduced\([^]*?\n}\n+vec4 sine\([^]*?\n}\n+vec4 cosine\([^]*?\n}/; // of glsl/functions/sine.glsl; a packed page has no empty lines

/** Returns the text. sha256: of hashOf(). Throws a ModelError for a model that is too wide.
 * @param {Model} model @param {string} sha256 */
export function functionText(model, sha256) {
    const name = functionName(model.name), program = withPrefix(lowered(model), `${name}_`);
    const {values, gradients, texture, constants} = program;
    const functions = [...values, ...gradients, ...(texture ? [texture] : [])];
    const broadest = Math.max(...functions.map(widest));
    if (broadest > WIDEST_LITERAL) {
        throw new ModelError(
            `a network ${broadest} wide is too large for constants in a shader, which take up to ${WIDEST_LITERAL}`,
        );
    }
    const withSines = (/** @type {string} */ line) => line.replace(/ = (sine|cosine)\(/, ` = ${name}_$1(`);
    const [sines] = document.getElementById("prologue").textContent.match(SINES) ?? [""];
    const lines = [
        headerLine(model, "glsl", sha256, {function: name, space: "model"}),
        ...usageComments(model, name),
        "",
        ...declareLiterals(functions, constants).map(byColumns),
        "",
        sines.replace(/\b(reduced|sine|cosine)\(/g, `${name}_$1(`),
        ...functions.flatMap((code) => ["", ...printFunction(code, straight(code).map(withSines))]),
        ...userFunctions(model, name, program),
    ];
    return `${lines.join("\n")}\n`;
}

/** Returns the function's name, made from the model's. facts.reserved: a pattern of names that GLSL reserves.
 * @param {string} text */
function functionName(text) {
    const trim = (/** @type {string} */ name) => name.replace(/^_+|_+$/g, "");
    const made = trim(trim(text.toLowerCase().replace(/[^a-z0-9]+/g, "_")).slice(0, LONGEST_NAME));
    const name = /^[a-z]/.test(made) ? made : trim(`sdf_${made}`);
    return new RegExp(`^(?:${facts.reserved})$`).test(name) ? `${name}_sdf` : name;
}

/** Prefixes the names of functions and constants of lowered().
 * @param {Lowered} program @param {string} prefix @returns {Lowered} */
function withPrefix({values, gradients, texture, constants}, prefix) {
    const rename = (/** @type {any} */ name) => (constants.has(name) ? prefix + name : name);
    /** @type {(code: Code) => Code} */ const change = (code) => ({
        ...code,
        name: prefix + code.name,
        ops: code.ops.map((
            op,
        ) => /** @type {Op} */ (Object.fromEntries(Object.entries(op).map(([key, name]) => [key, rename(name)])))),
    });
    return {
        values: values.map(change),
        gradients: gradients.map(change),
        texture: texture && change(texture),
        constants: /** @type {Table<Constant>} */ (
            new Map(Array.from(constants, ([key, constant]) => [prefix + key, constant]))
        ),
    };
}

/** Makes a mat4 of its columns, as Godot does. @param {string} line */
function byColumns(line) {
    return line.replace(/ = mat4\((.*)\)/, (_, text) => {
        const numbers = text.split(", "),
            column = (/** @type {number} */ k) => `vec4(${numbers.slice(k, k + 4).join(", ")})`;
        return ` = mat4(${[0, 4, 8, 12].map(column).join(", ")})`;
    });
}

/** @param {Model} model @param {string} name */
function usageComments({levels, inputs}, name) {
    const time = inputs === "xyzt" ? ", time" : "";
    return [
        `// A neural signed distance function of ${levels.length} nested level${levels.length > 1 ? "s" : ""}.`,
        "// Points and distances: the shape fits the unit sphere, y is up.",
        `// ${name}(p${time}): signed distance, negative inside. `
        + `${name}_level(p, level${time}): levels 1 to \`level\`.`,
        `// ${name}_normal(p${time}): its gradient, of length 1. ${name}_color(p${time}): color on the surface, sRGB.`,
    ];
}

/** Returns the functions that a user calls. @param {Model} model @param {string} name @param {Lowered} program */
function userFunctions({levels, inputs}, name, {values, gradients, texture}) {
    const moves = inputs === "xyzt", time = moves ? ", float time" : "";
    const input = `vec4(p.x, p.y, p.z, ${moves ? "time" : "1."})`;
    /** @param {string} type @param {string} suffix @param {string} parameters @param {string[]} lines
     * @param {string} result */
    const print = (type, suffix, parameters, lines, result) => [
        "",
        `${type} ${name}${suffix}(vec3 p${parameters}) {`,
        ...lines,
        `    return ${result};`,
        "}",
    ];
    const value = sumOfLevels(levels, values, input, "float", "level");
    const gradient = sumOfLevels(levels, gradients, input, "vec4", "");
    const [x, y, z] = gradient.results, length = `a${gradient.count + 1}`;
    const squares = `(((${x} * ${x}) + (${y} * ${y})) + (${z} * ${z}))`;
    const color = texture ?
        ["x", "y", "z"].map((c) => `min(max(r1.${c}, 0.), 1.)`)
        : shared.plain.split(",").map((c) => number(Number(c)));
    return [
        ...print("float", "_level", `, int level${time}`, value.lines, value.results[0]),
        ...print("float", "", time, [], `${name}_level(p, ${levels.length}${moves ? ", time" : ""})`),
        ...print(
            "vec3",
            "_normal",
            time,
            [...gradient.lines, `    float ${length} = sqrt(${squares});`],
            `vec3(${[x, y, z].map((c) => `(${c} / ${length})`).join(", ")})`,
        ),
        ...print(
            "vec3",
            "_color",
            time,
            texture ? [`    vec3 r1 = ${texture.name}(${input});`] : [],
            `vec3(${color.join(", ")})`,
        ),
    ];
}

/** Adds the outputs of functions, level by level (Eq. 3), as codegen/printers/user_functions.py. level: name of the
 * finest level's number, or "". Returns statements, the sums of the components, and the number of variables.
 * @param {Level[]} levels @param {Code[]} functions @param {string} input @param {"float" | "vec4"} type
 * @param {string} level */
function sumOfLevels(levels, functions, input, type, level) {
    const isVector = type === "vec4", lines = [], next = (/** @type {string} */ letter) => letter + ++count;
    const parts = (/** @type {string} */ r) => (isVector ? [`${r}.xyz.x`, `${r}.xyz.y`, `${r}.xyz.z`, `${r}.w`] : [r]);
    let count = 0, condition = "", last = next("r");
    lines.push(`    ${type} ${last} = ${functions[0].name}(${input});`);
    let results = parts(last);
    functions.slice(1).forEach((code, i) => {
        const near = `(abs(${results.at(-1)}) < ${number(levels[i].delta)})`;
        const inside = level ? `((${level} > ${i + 1}) && ${near})` : near;
        const all = condition ? `(${condition} && ${inside})` : inside;
        condition = next("c");
        last = next("r");
        lines.push(`    bool ${condition} = ${all};`);
        lines.push(`    ${type} ${last} = ${isVector ? "vec4(0., 0., 0., 0.)" : "0."};`);
        lines.push(`    if (${condition}) { ${last} = ${code.name}(${input}); }`);
        results = parts(last).map((part, k) => {
            const name = next("a"), isRead = !isVector || k < 3 || i + 2 < functions.length;
            if (isRead) lines.push(`    float ${name} = (${results[k]} + ${part});`);
            return name;
        });
    });
    return {lines, results, count};
}
