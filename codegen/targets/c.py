"""Target c: the distance function in C99, with its normal and color. It needs only the standard library."""

import re
from collections.abc import Mapping, Sequence
from typing import ClassVar

from ...ir.program import Affine, Cosine, Dot, Function, Op, Product, Scale, Sine, Transposed
from ..printers.array_functions import ArrayFunctions
from ..printers.cstyle import Language
from ..printers.scalars import Inputs, output_count
from ..printers.trace import TracingLanguage
from .function_target import function_target

EACH = "float {result}[{width}]; for (int o = 0; o < {width}; o++) "
SUM = "{{ {result}[o] = %s; for (int i = 0; i < {inner}; i++) {result}[o] += {matrix}[%s] * {source}[i]; }}"


class CFunctions(ArrayFunctions, TracingLanguage):
    """Arrays are flat. A network writes its outputs one after the other."""

    point = ("p[0]", "p[1]", "p[2]")
    opening = ("// p, the normal and the color are three floats. Link with -lm.", "", "#include <math.h>")
    both, pick = "{0} && {1}", "({condition} ? {yes} : {no})"
    vector, loop = "(const float[3]){{{0}, {1}, {2}}}", Language.loop
    let, let_condition = "float {name} = {value};", "int {name} = {value};"
    functions = {name: f"{name}f({{0}})" for name in ("sqrt", "sin", "cos")} | {
        "abs": "fabsf({0})",
        "min": "fminf({0}, {1})",
        "max": "fmaxf({0}, {1})",
    }
    constant = "static const float {name}[{size}] = {{\n    {values},\n}};"
    bias = "{0}[o]"
    ops: ClassVar[Mapping[type[Op], str]] = {
        Affine: EACH + SUM % ("{bias}", "{inner} * o + i"),
        Transposed: EACH + SUM % ("0.f", "{width} * i + o"),
        Sine: EACH + "{result}[o] = sinf({source}[o]);",
        Cosine: EACH + "{result}[o] = cosf({source}[o]);",
        Product: EACH + "{result}[o] = {left}[o] * {right}[o];",
        Scale: EACH + "{result}[o] = {factor} * {source}[o];",
        Dot: "float {result}[1] = {{0.f}}; for (int i = 0; i < {inner}; i++) {result}[0] += {row}[i] * {source}[i]; "
        "{result}[0] = {scale} * {result}[0] + {bias};",
    }

    def number(self, value: float) -> str:
        return Language(suffix="f").number(value)

    def network(self, function: Function, statements: list[str]) -> list[str]:
        outputs = [f"{name}[{k}]" for name in function.outputs for k in range(3 if name == "gradient" else 1)]
        results = [f"    out[{k}] = {output};" for k, output in enumerate(outputs)]
        return [f"static void {function.name}(const float p[4], float out[])", "{", *statements, *results, "}"]

    def call(self, name: str, function: Function, inputs: Inputs, condition: str | None) -> list[str]:
        where = "" if condition is None else f"if ({condition}) "
        call = f"{{ const float at[4] = {{{', '.join(inputs)}}}; {function.name}(at, {name}); }}"
        return [f"float {name}[{output_count(function)}] = {{0.f}};", where + call]

    def function(
        self, kind: str, name: str, parameters: Sequence[tuple[str, str]], lines: list[str], results: list[str]
    ) -> list[str]:
        taken = ["const float p[3]", *(f"{kind} {parameter}" for kind, parameter in parameters)]
        if kind == "float":
            lines = [*lines, f"return {results[0]};"]
        else:
            kind, result = "void", name.rpartition("_")[2]
            taken.append(f"float {result}[3]")
            lines = [*lines, *(f"{result}[{k}] = {value};" for k, value in enumerate(results))]
        words = set(re.findall(r"\w+", " ".join(lines)))
        unused = [f"(void){entry};" for entry in ("p", *(entry for _, entry in parameters)) if entry not in words]
        return [f"{kind} {name}({', '.join(taken)})", "{", *(f"    {line}" for line in [*unused, *lines]), "}"]

    def results(self, name: str, values: Sequence[str]) -> list[str]:
        if len(values) == 1:
            return [f"*{name} = {values[0]};"]
        return [" ".join(f"{name}[{k}] = {value};" for k, value in enumerate(values))]

    def store_normal(self, name: str, arguments: str) -> list[str]:
        return [f"{name}_normal({arguments}, normal);"]

    def trace_head(self, name: str, parameters: Sequence[tuple[str, str]]) -> list[str]:
        taken = [f"const float {entry}[3]" if kind == "vec3" else f"{kind} {entry}" for kind, entry in parameters]
        head = f"bool {name}({', '.join([*taken, 'float *t', 'float normal[3]'])})"
        return ["#include <stdbool.h>", "", head, "{"]


standalone = function_target("c", lambda _: CFunctions())
