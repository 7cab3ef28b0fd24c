// Shared by both storages of weights, as codegen/printers/cstyle.py.

/** Returns the names of the functions' constants in order of their first use. @param {Code[]} functions */
export function constantsOf(functions) {
    const names = functions.flatMap(({ops}) => ops.flatMap(({matrix, bias, row}) => [matrix, bias, row]));
    return new Set(/** @type {string[]} */ (names.filter(Boolean)));
}

/** Returns the right-hand side of an elementwise op; at: prints an operand.
 * @param {Op} op @param {(operand: string | undefined) => string} at */
export function elementwise(op, at) {
    return op.kind === "product" ? `${at(op.left)} * ${at(op.right)}` : `${op.kind}(${at(op.source)})`;
}

/** Returns the shortest literal of a 32-bit float. @param {number} value */
export function number(value) {
    const x = Math.fround(value);
    let digits = 9; // most floats need nearly as many
    while (digits > 1 && Math.fround(Number(x.toPrecision(digits - 1))) === x) --digits;
    const rounded = roundedToEven(x, digits);
    if (x && Math.abs(x) < 1e-4) return rounded.toExponential(digits - 1);
    const text = Object.is(x, -0) ? "-0" : String(rounded);
    if (/e/.test(text)) return text.replace("e+", "e");
    return text.includes(".") ? text.replace(/^(-?)0\./, "$1.") : `${text}.`;
}

/** Rounds x to `digits` digits. Between two equally near decimals, toPrecision takes the larger one; NumPy takes the
 * even one if it reads back as the same 32-bit float.
 * @param {number} x @param {number} digits */
function roundedToEven(x, digits) {
    const [larger, exact] = [digits, digits + 1].map((count) => x.toExponential(count - 1).split("e"));
    const isTie = exact[0].endsWith("5") && Number(exact.join("e")) === x;
    if (!isTie || Number(larger[0].at(-1)) % 2 === 0) return Number(larger.join("e"));
    const even = Number(`${larger[0].slice(0, -1)}${Number(larger[0].at(-1)) - 1}e${larger[1]}`);
    return Math.fround(even) === x ? even : Number(larger.join("e"));
}
