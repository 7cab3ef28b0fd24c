import {constantsOf, elementwise, number} from "./cstyle.js";

// Prints weights as named constants in straight-line code, as codegen/printers/literal.py.

/** Returns one declaration for each vec4 or 4 x 4 block, in order of first use.
 * @param {Code[]} functions @param {Table<Constant>} constants */
export function declareLiterals(functions, constants) {
    const lines = [], literals = (/** @type {Numbers} */ values) => Array.from(values, number).join(", ");
    for (const name of constantsOf(functions)) {
        const {rows, columns, values} = constants.get(name);
        for (let o = 0; o < rows; o += 4) {
            if (!columns) lines.push(`const vec4 ${name}_${o / 4} = vec4(${literals(values.subarray(o, o + 4))});`);
            for (let i = 0; i < columns; i += 4) {
                const block = Array.from({length: 16}, (_, k) => values[(o + k % 4) * columns + i + (k >> 2)]);
                lines.push(`const mat4 ${name}_${o / 4}_${i / 4} = mat4(${literals(block)});`);
            }
        }
    }
    return lines;
}

/** Returns a function's statements, without loops; each term of a sum is a separate `+=`.
 * @param {Pick<Code, "ops" | "blocks">} code */
export function straight({ops, blocks}) {
    /** @type {string[]} */
    const lines = [], at = (value = "", k = 0) => (blocks.get(value) === 1 ? value : `${value}_${k}`);
    for (const op of ops) {
        const over = (/** @type {(i: number, operand: string) => string} */ print) => (
            Array.from({length: blocks.get(op.source)}, (_, i) => print(i, at(op.source, i)))
        );
        for (let k = 0; k < blocks.get(op.result); ++k) {
            const name = at(op.result, k);
            const terms = /** @type {Record<string, () => string[]>} */ ({
                affine: () => [
                    ...(op.bias ? [`${op.bias}_${k}`] : []),
                    ...over((i, h) => `${op.matrix}_${k}_${i} * ${h}`),
                ],
                transposed: () => over((o, g) => `${g} * ${op.matrix}_${o}_${k}`),
                dot: () => [number(/** @type {number} */ (op.offset)), ...over((i, h) => `dot(${op.row}_${i}, ${h})`)],
            })[op.kind]?.() ?? [elementwise(op, (value) => at(value, k))];
            lines.push(`${op.kind === "dot" ? "float" : "vec4"} ${name} = ${terms[0]};`);
            lines.push(...terms.slice(1).map((term) => `${name} += ${term};`));
        }
    }
    return lines;
}
