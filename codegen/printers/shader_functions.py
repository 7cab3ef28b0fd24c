"""The user's functions in the languages with vec4."""

import re
from collections.abc import Sequence
from dataclasses import replace

from ... import glsl
from ...ir.program import Program
from .cstyle import Language
from .literal import LiteralStorage
from .scalars import VectorNotation
from .trace import TracingLanguage


class ShaderFunctions(VectorNotation, TracingLanguage):
    """Weights are constants. Sines are those of sine.glsl, since the built-in ones are coarse on some devices."""

    point = ("p.x", "p.y", "p.z")

    def __init__(self, language: Language, name: str) -> None:
        """name: prefix of all global names."""
        super().__init__(replace(language, sine=f"{name}_sine", cosine=f"{name}_cosine"))
        self._name = name
        self.vector, self.loop = f"{language.type('vec3')}({{0}}, {{1}}, {{2}})", language.loop

    def networks(self, program: Program) -> list[str]:
        storage = LiteralStorage(program, self.language, program.functions())
        lines = ["", *storage.declarations(), "", *self._sines()]
        for function in program.functions():
            lines += ["", *storage.definition(function)]
        return lines

    def function(
        self, kind: str, name: str, parameters: Sequence[tuple[str, str]], lines: list[str], results: list[str]
    ) -> list[str]:
        head = self.language.begin(kind, name, self.language.taken(("vec3", "p"), *parameters))
        result = results[0] if kind == "float" else f"{self.language.type(kind)}({', '.join(results)})"
        return [head, *(f"    {line}" for line in lines), f"    return {result};", "}"]

    def results(self, name: str, values: Sequence[str]) -> list[str]:
        value = values[0] if len(values) == 1 else self.vector.format(*values)
        return [self.language.assign.format(name=name, value=value)]

    def store_normal(self, name: str, arguments: str) -> list[str]:
        return self.results("normal", [f"{name}_normal({arguments})"])

    def trace_head(self, name: str, parameters: Sequence[tuple[str, str]]) -> list[str]:
        out = [
            self.language.out.format(type=self.language.type(kind), name=result)
            for kind, result in (("float", "t"), ("vec3", "normal"))
        ]
        return [self.language.begin("bool", name, ", ".join([self.language.taken(*parameters), *out]))]

    def _sines(self) -> list[str]:
        """Return the functions of sine.glsl in the language. Raises ValueError at a line of unknown form."""
        text = re.sub(r"\b(reduced|sine|cosine)\(", rf"{self._name}_\1(", glsl.load("sine.glsl"))
        lines = []
        for line in text.splitlines():
            if head := re.fullmatch(r"vec4 (\w+)\(vec4 x\) \{", line):
                lines.append(self.language.begin("vec4", head[1], self.language.taken(("vec4", "x"))))
            elif local := re.fullmatch(r"    vec4 (\w+) = (.*);", line):
                lines.append("    " + self.language.local("vec4", local[1], local[2]))
            elif re.fullmatch(r"    return .*;|\}|", line):
                lines.append(line)
            elif not line.startswith("//"):
                raise ValueError(f"sine.glsl: {line}")
        return lines
