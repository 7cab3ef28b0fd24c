"""The program: what every target prints and the numpy reference runs. A handful of ops on vectors packed in vec4."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]

INPUT = "p"
"""Every function's input, one vec4: (x, y, z, 1), or (x, y, z, t) where the field moves."""


@dataclass(frozen=True)
class Affine:
    """result = matrix source + bias; bias None: no bias (it is folded into the matrix)."""

    result: str
    source: str
    matrix: str
    bias: str | None


@dataclass(frozen=True)
class Transposed:
    """result = transpose(matrix) source: the adjoint of Affine, the same stored matrix."""

    result: str
    source: str
    matrix: str


@dataclass(frozen=True)
class Sine:
    """result = sin(source), elementwise."""

    result: str
    source: str


@dataclass(frozen=True)
class Cosine:
    """result = cos(source), elementwise."""

    result: str
    source: str


@dataclass(frozen=True)
class Product:
    """result = left * right, elementwise; `left` is a constant or a value."""

    result: str
    left: str
    right: str


@dataclass(frozen=True)
class Dot:
    """result = scale * dot(row, source) + bias, a scalar; `row` is a constant."""

    result: str
    source: str
    row: str
    scale: float
    bias: float


@dataclass(frozen=True)
class Scale:
    """result = factor * source."""

    result: str
    source: str
    factor: float


Op = Affine | Transposed | Sine | Cosine | Product | Dot | Scale


@dataclass(frozen=True)
class Function:
    """Straight-line ops over named values, each assigned once. `outputs` are value names."""

    name: str
    ops: tuple[Op, ...]
    outputs: tuple[str, ...]


@dataclass(frozen=True)
class Cost:
    """Of one evaluation: multiply-adds and sines (or cosines), zero padding counted."""

    multiply_adds: int
    sines: int

    def __add__(self, other: "Cost") -> "Cost":
        return Cost(self.multiply_adds + other.multiply_adds, self.sines + other.sines)


@dataclass(frozen=True)
class Band:
    """A level's numbers for sphere tracing: delta (model units), iterations."""

    delta: float
    iterations: int


@dataclass(frozen=True, eq=False)
class Program:
    """A model lowered to functions.

    bands: one per level. values, gradients: one function per level's network, outputs (value) and
    (gradient as vec4 with an unused w, value). texture: outputs (r, g, b), or None.
    constants: matrices (4 m, 4 n) and vectors (4 n,), float32, zero padded.
    moving: the fourth input is time.
    """

    name: str
    sha256: str
    bands: tuple[Band, ...]
    values: tuple[Function, ...]
    gradients: tuple[Function, ...]
    texture: Function | None
    constants: dict[str, Array]
    moving: bool = False

    def functions(self) -> tuple[Function, ...]:
        """All functions, callees first."""
        return (*self.values, *self.gradients, *(() if self.texture is None else (self.texture,)))

    def widest(self, function: Function) -> int:
        """Largest dimension of the matrices that `function` multiplies by."""
        products = (op for op in function.ops if isinstance(op, Affine | Transposed))
        return max(int(max(self.constants[op.matrix].shape)) for op in products)

    def widths(self, function: Function) -> dict[str, int]:
        """Value name -> number of components. Raises ValueError where an op is ill-formed."""
        widths = {INPUT: 4}
        for op in function.ops:
            if op.result in widths or op.result in self.constants:
                raise ValueError(f"{function.name}: {op.result} is assigned twice")
            widths[op.result] = self._width(op, widths)
        missing = [name for name in function.outputs if name not in widths]
        if missing:
            raise ValueError(f"{function.name}: outputs {missing} are never assigned")
        return widths

    def check(self) -> None:
        """Raises ValueError where the program is not one that targets can print."""
        for name, constant in self.constants.items():
            if constant.dtype != np.float32 or any(size % 4 for size in constant.shape) or constant.ndim > 2:
                raise ValueError(f"{name}: constants are float32, sizes multiples of 4")
            if not np.isfinite(constant).all():
                raise ValueError(f"{name}: not finite")
        if not len(self.bands) == len(self.values) == len(self.gradients) > 0:
            raise ValueError("every level needs a band, a value and a gradient")
        for function in self.functions():
            self.widths(function)

    def cost(self, function: Function) -> Cost:
        """Multiply-adds and sines of one call of `function`."""
        widths = self.widths(function)
        multiply_adds = sines = 0
        for op in function.ops:
            match op:
                case Affine(matrix=matrix) | Transposed(matrix=matrix):
                    multiply_adds += self.constants[matrix].size
                case Sine() | Cosine():
                    sines += widths[op.result]
                case Dot(source=source):
                    multiply_adds += widths[source]
                case Product() | Scale():
                    multiply_adds += widths[op.result]
        return Cost(multiply_adds, sines)

    def _width(self, op: Op, widths: dict[str, int]) -> int:
        def width(name: str) -> int:
            if name in widths:
                return widths[name]
            if name in self.constants and self.constants[name].ndim == 1:
                return len(self.constants[name])
            raise ValueError(f"{op}: {name} is not defined")

        def expect(condition: bool) -> None:
            if not condition:
                raise ValueError(f"{op}: widths differ")

        match op:
            case Affine(source=source, matrix=matrix, bias=bias):
                rows, columns = map(int, self.constants[matrix].shape)
                expect(width(source) == columns and (bias is None or width(bias) == rows))
                return rows
            case Transposed(source=source, matrix=matrix):
                rows, columns = map(int, self.constants[matrix].shape)
                expect(width(source) == rows)
                return columns
            case Product(left=left, right=right):
                expect(width(left) == width(right))
                return width(left)
            case Dot(source=source, row=row):
                expect(width(row) == width(source))
                return 1
            case _:
                return width(op.source)
