"""The program: the computation of a model, in seven ops. Every target prints it.

This file is the definition; a printer for another language needs nothing else. field/interpret.py is the same
definition as NumPy code.

**Functions.** A `Function` is a list of ops without branches or loops. Each op assigns one new value, which later ops
refer to by name. The input of a function has the name `INPUT`; its results are the values in `outputs`. Names are local
to their function and are identifiers in any C-like language.

**Values.** A value is a vector of 32-bit floats, made of n blocks of four: block k, a vec4, holds the components 4 k to
4 k + 3. Only the result of a `Dot` is a scalar, and no op has a scalar operand. `Program.widths` returns the number of
components of each value.

**Constants.** `Program.constants` holds the weights by name; all functions share them. A matrix is (rows, columns), one
row for each component of the product. Its block (o, i), rows 4 o to 4 o + 3 and columns 4 i to 4 i + 3, is a mat4 that
multiplies block i of the source for block o of the result. A vector is (n,).

**Padding.** Sizes that are not multiples of 4 are zero-padded at the end: rows and columns of matrices, and entries of
vectors. In the padded components of a value, Affine and Sine return 0, and Cosine returns 1. They never reach an
output, because zeros multiply them.

**Results.** Let f_level = values[0] + ... + values[level - 1], each at the same input.

- The field is the nested field of `field/interpret.py`, `nested_levels`, with the bands of this program (Eq. 3).
- The gradient of f_level is the sum of the first outputs of gradients[0] to gradients[level - 1].
- The color is `texture`'s output, clamped to [0, 1], sRGB; targets color a model without one.

The program of a scene has the functions of all its models; composition.py defines its results.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .composition import Composition

Array = NDArray[np.float32]

INPUT = "p"
"""Name of every function's input, one vec4 in model space: (x, y, z, 1), or (x, y, z, t) in moving programs."""


@dataclass(frozen=True)
class _Op:
    """Assigns a new value to the name `result`, computed from the value `source`."""

    result: str
    source: str


@dataclass(frozen=True)
class Affine(_Op):
    """result = matrix source + bias: a layer of a network, before its sine."""

    matrix: str
    """A constant, (rows, columns)."""
    bias: str | None
    """A constant, (rows,). None if a column of the matrix multiplies the input's 1 instead."""


@dataclass(frozen=True)
class Transposed(_Op):
    """result = transpose(matrix) source: the adjoint of Affine, with the same constant."""

    matrix: str
    """A constant, (rows, columns)."""


@dataclass(frozen=True)
class Sine(_Op):
    """result = sin(source), componentwise, radians."""


@dataclass(frozen=True)
class Cosine(_Op):
    """result = cos(source), componentwise, radians."""


@dataclass(frozen=True)
class Product:
    """result = left * right, componentwise."""

    result: str
    left: str
    """A value, or a constant vector."""
    right: str
    """A value."""


@dataclass(frozen=True)
class Dot(_Op):
    """result = scale * (row . source) + bias: one output of a network, a scalar."""

    row: str
    """A constant vector, as wide as the source."""
    scale: float
    """1 unless the row was rounded (lower.py)."""
    bias: float


@dataclass(frozen=True)
class Scale(_Op):
    """result = factor * source, with one number for all components."""

    factor: float


Op = Affine | Transposed | Sine | Cosine | Product | Dot | Scale


@dataclass(frozen=True)
class Function:
    """Ops in execution order, from one input to one or more outputs."""

    name: str
    """Unique in the program, an identifier."""
    ops: tuple[Op, ...]
    outputs: tuple[str, ...]
    """Names of the returned values."""


@dataclass(frozen=True)
class Cost:
    """The number of operations of one evaluation, padded components included."""

    multiply_adds: int
    sines: int
    """Sines and cosines."""

    def __add__(self, other: "Cost") -> "Cost":
        return Cost(self.multiply_adds + other.multiply_adds, self.sines + other.sines)


@dataclass(frozen=True)
class Band:
    """The parameters of one level for sphere tracing."""

    delta: float
    """Half width of the band |f_i| < delta, model units."""
    iterations: int
    """Steps per round."""
    step_bound: float
    """Factor on the steps if this is the last traced level, in (0, 1]."""
    band_step_bound: float
    """Factor on the steps if a finer level is traced, in (0, 1]."""


@dataclass(frozen=True, eq=False)
class Program:
    """A model, lowered to functions and constants; see the docstring of this file."""

    name: str
    """The model's name: any text, so generated code must escape it."""
    sha256: str
    """Hash of the model, hexadecimal."""
    bands: tuple[Band, ...]
    """One for each level, coarsest first."""
    values: tuple[Function, ...]
    """The network of each level: level 1's distance, or a finer level's residual. Output: (f,), a scalar."""
    gradients: tuple[Function, ...]
    """The gradient and value of each level's network. Outputs: (gradient, f), a vec4 and a scalar. The first three
    components of the gradient are the derivatives along x, y and z; the fourth is unused."""
    texture: Function | None
    """The network of the color, or None. Outputs: (r, g, b), three scalars, sRGB, not clamped."""
    constants: dict[str, Array]
    """Name -> float32 matrix (rows, columns) or vector (n,), zero-padded to multiples of 4."""
    moving: bool = False
    """Whether the fourth component of the input is time, not 1."""
    composition: "Composition[Program] | None" = None
    """Set for a scene, which has no values, gradients or texture."""

    @property
    def colored(self) -> bool:
        """Whether the program has colors."""
        return self.texture is not None or self.composition is not None

    def functions(self) -> tuple[Function, ...]:
        """Return all functions: values, gradients, texture."""
        if self.composition is not None:
            return tuple(function for program in self.composition.programs for function in program.functions())
        return (*self.values, *self.gradients, *(() if self.texture is None else (self.texture,)))

    def widest(self, function: Function) -> int:
        """Return the largest side of the matrices of a function."""
        products = (op for op in function.ops if isinstance(op, Affine | Transposed))
        return max(int(max(self.constants[op.matrix].shape)) for op in products)

    def widths(self, function: Function) -> dict[str, int]:
        """Return the number of components of each value of a function, input included."""
        widths = {INPUT: 4}
        for op in function.ops:
            match op:
                case Affine(matrix=matrix):
                    width = self.constants[matrix].shape[0]
                case Transposed(matrix=matrix):
                    width = self.constants[matrix].shape[1]
                case Product(right=right):
                    width = widths[right]
                case Dot():
                    width = 1
                case _:
                    width = widths[op.source]
            widths[op.result] = width
        return widths

    def cost(self, function: Function) -> Cost:
        """Count the operations of one call of a function."""
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

    def value_costs(self) -> tuple[Cost, ...]:
        """Count the operations of each level's value; for a scene, if all shapes are evaluated."""
        if self.composition is None:
            return tuple(self.cost(function) for function in self.values)
        costs = [Cost(0, 0)] * len(self.bands)
        for leaf in self.composition.leaves:
            if isinstance(leaf.part, Program):
                for i, cost in enumerate(leaf.part.value_costs()[: len(costs)]):
                    costs[i] += cost
        return tuple(costs)
