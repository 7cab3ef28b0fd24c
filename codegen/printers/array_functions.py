"""The user's functions in the languages without vec4, where each value of a program is one array."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import fields
from typing import ClassVar

from ...ir.program import Affine, Array, Function, Op, Program
from .cstyle import constants_of
from .scalars import Inputs
from .user_functions import FunctionLanguage

PER_LINE = 8
"""Weights in a line."""


class ArrayFunctions(FunctionLanguage):
    """A language is a table of formats: one for each kind of op, with the op's fields and the widths of its values."""

    ops: ClassVar[Mapping[type[Op], str]]
    """Kind of op -> format with its fields, `width` of the result and `inner`, the width of the source."""
    bias: str
    """Start of Affine's sums, {0} being the bias."""
    constant: str
    """Constant {name} with {values}, its {size} and its {shape}."""

    def networks(self, program: Program) -> list[str]:
        lines = [""]
        for name in constants_of(program.functions()):
            lines += self._constant(name, program.constants[name])
        for function in program.functions():
            widths = program.widths(function)
            statements = [f"    {self._statement(op, widths)}" for op in function.ops]
            lines += ["", *self.network(function, statements)]
        return lines

    @abstractmethod
    def network(self, function: Function, statements: list[str]) -> list[str]:
        """Return a network's function, which computes the outputs of `output_count`."""

    def output(self, name: str, function: Function, k: int) -> str:
        return f"{name}[{k}]"

    @abstractmethod
    def call(self, name: str, function: Function, inputs: Inputs, condition: str | None) -> list[str]:
        """See `Notation`."""

    def weight(self, value: float) -> str:
        """Return a weight as a literal."""
        return self.number(value)

    def _constant(self, name: str, values: Array) -> list[str]:
        weights = [self.weight(float(value)) for value in values.ravel()]
        rows = [", ".join(weights[i : i + PER_LINE]) for i in range(0, len(weights), PER_LINE)]
        shape = ", ".join(map(str, values.shape))
        text = self.constant.format(name=name, values=",\n    ".join(rows), size=values.size, shape=shape)
        return text.splitlines()

    def _statement(self, op: Op, widths: dict[str, int]) -> str:
        texts = {entry.name: getattr(op, entry.name) for entry in fields(op)}
        texts = {key: self.weight(value) if isinstance(value, float) else value for key, value in texts.items()}
        if isinstance(op, Affine):
            texts["bias"] = self.bias.format(op.bias) if op.bias else self.weight(0.0)
        return self.ops[type(op)].format(**texts, width=widths[op.result], inner=widths.get(texts.get("source", ""), 0))
