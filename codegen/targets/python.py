"""Target python: the distance function for NumPy, with its normal and color, in one file that needs no mplicits."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from ...ir.program import Affine, Cosine, Dot, Function, Op, Product, Program, Scale, Sine, Transposed
from ..printers.array_functions import ArrayFunctions
from ..printers.scalars import Inputs
from .function_target import function_target


class PythonFunctions(ArrayFunctions):
    """A scalar is an array with a number for each point; a network returns its outputs as columns."""

    comment, private = "#", "_"
    point = ("x", "y", "z")
    opening = ("# p: points (..., 3). The results have the shapes (...) and (..., 3).", "", "import numpy as np")
    both, pick = "{0} & {1}", "np.where({condition}, {yes}, {no})"
    let = let_condition = "{name} = {value}"
    functions = {name: f"np.{name}({{0}})" for name in ("sqrt", "sin", "cos", "abs")} | {
        "min": "np.minimum({0}, {1})",
        "max": "np.maximum({0}, {1})",
    }
    constant = "{name} = np.array([\n    {values},\n], np.float32).reshape({shape})"
    bias = "{0}"
    ops: ClassVar[Mapping[type[Op], str]] = {
        Affine: "{result} = {source} @ {matrix}.T + {bias}",
        Transposed: "{result} = {source} @ {matrix}",
        Sine: "{result} = np.sin({source})",
        Cosine: "{result} = np.cos({source})",
        Product: "{result} = {left} * {right}",
        Scale: "{result} = np.float32({factor}) * {source}",
        Dot: "{result} = np.float32({scale}) * ({source} @ {row}) + np.float32({bias})",
    }

    def __init__(self, name: str) -> None:
        """name: prefix of all global names."""
        self._call = f"_{name}_call"

    def number(self, value: float) -> str:
        return repr(float(value))

    def weight(self, value: float) -> str:
        return str(np.float32(value))

    def networks(self, program: Program) -> list[str]:
        return [
            *super().networks(program),
            *("", "", f"def {self._call}(network, where, *inputs):"),
            "    q = np.stack(np.broadcast_arrays(*inputs), axis=1).astype(np.float32)",
            "    outputs = network(q[where])",
            "    everywhere = np.zeros((len(q), outputs.shape[1]))",
            "    everywhere[where] = outputs",
            "    return everywhere.T",
        ]

    def network(self, function: Function, statements: list[str]) -> list[str]:
        columns = ", ".join("gradient[:, :3]" if name == "gradient" else name for name in function.outputs)
        return ["", f"def {function.name}(p):", *statements, f"    return np.column_stack([{columns}])"]

    def call(self, name: str, function: Function, inputs: Inputs, condition: str | None) -> list[str]:
        return [f"{name} = {self._call}({function.name}, {condition or 'slice(None)'}, {', '.join(inputs)})"]

    def function(
        self, kind: str, name: str, parameters: Sequence[tuple[str, str]], lines: list[str], results: list[str]
    ) -> list[str]:
        head = f"def {name}({', '.join(['p', *(parameter for _, parameter in parameters)])}):"
        if not lines and kind == "float":
            return ["", head, f"    return {results[0]}"]
        if kind == "float":
            end = [f"return np.float32({results[0]}).reshape(np.shape(p)[:-1])"]
        else:
            columns = [f"result[:, {k}] = {value}" for k, value in enumerate(results)]
            end = ["result = np.empty((len(x), 3), np.float32)", *columns, "return result.reshape(np.shape(p))"]
        body = ["x, y, z = np.asarray(p, np.float64).reshape(-1, 3).T", *lines, *end]
        return ["", head, *(f"    {line}" for line in body)]


standalone = function_target("python", PythonFunctions)
