// What both ways to store the weights print alike, as codegen/printers/cstyle.py has it.

// The names of the constants that functions use, each once, in order of first use.
export function constantsOf(functions) {
    const names = functions.flatMap(({ops}) => ops.flatMap(({matrix, bias, row}) => [matrix, bias, row]));
    return new Set(names.filter(Boolean));
}

// The right-hand side of an elementwise op, its operands printed by `at`.
export function elementwise(op, at) {
    return op.kind === "product" ? `${at(op.left)} * ${at(op.right)}` : `${op.kind}(${at(op.source)})`;
}

// Shortest literal that reads back as the same float32.
export function number(value) {
    const x = Math.fround(value);
    let digits = 1;
    while (digits < 9 && Math.fround(Number(x.toPrecision(digits))) !== x) ++digits;
    if (x && Math.abs(x) < 1e-4) return x.toExponential(digits - 1);
    const text = String(Number(x.toPrecision(digits)));
    if (/e/.test(text)) return text.replace("e+", "e");
    return text.includes(".") ? text.replace(/^(-?)0\./, "$1.") : `${text}.`;
}
