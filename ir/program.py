"""The program: a model's computation in seven ops. Every target prints it, and field/interpret.py runs it in numpy.

**Functions.** A `Function` is a list of ops without branches or loops. Its input has the name `INPUT`. Each op assigns
one new value, and later ops refer to it by name. `outputs` lists the values that the function returns. Names of values
are local to their function, and are identifiers in any C-like language.

**Values.** A value is a vector of float32 in blocks of four: block k, a vec4, holds the components 4 k to 4 k + 3. Only
the result of a `Dot` is a scalar, and no op takes a scalar.

**Constants.** `Program.constants` holds the weights by name. All functions share them: a network's value and its
gradient read the same matrices. A matrix is (rows, columns) with one row for each component of the product. Its block
(o, i), rows 4 o to 4 o + 3 and columns 4 i to 4 i + 3, is a mat4 from block i of the source to block o of the result. A
vector is (n,).

**Padding.** Zeros fill rows, columns and vectors up to multiples of 4. So values have padded components: Affine and
Sine make them 0, Cosine makes them 1. They never reach an output, since a zero multiplies each of them.

**Field.** With f_level = values[0] + ... + values[level - 1], each at the same input:

- Eq. 3: level 1 is defined everywhere, and level i + 1 where level i is and |f_i| < bands[i - 1].delta. The field is
  f_i of the finest level i that is defined at the point.
- The gradient of f_level is the sum of the first outputs of gradients[0] to gradients[level - 1].
- The color is the output of `texture`, clamped to [0, 1], sRGB. A target chooses the color of a model without one.

A scene's program has the functions of all its models; composition.py defines how they combine.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .composition import Composition

Array = NDArray[np.float32]

INPUT = "p"
"""Name of every function's input, a vec4 in model space: (x, y, z, 1), or (x, y, z, t) of a moving field."""


@dataclass(frozen=True)
class Affine:
    """result = matrix source + bias: a layer of a network, before its sine."""

    result: str
    source: str
    matrix: str
    """A constant, (width of the result, width of the source)."""
    bias: str | None
    """A constant; None where the matrix column for the input's 1 is the bias."""


@dataclass(frozen=True)
class Transposed:
    """result = transpose(matrix) source: the adjoint of Affine, with the same constant."""

    result: str
    source: str
    matrix: str
    """A constant, (width of the source, width of the result)."""


@dataclass(frozen=True)
class Sine:
    """result = sin(source), component by component, in radians."""

    result: str
    source: str


@dataclass(frozen=True)
class Cosine:
    """result = cos(source), component by component, in radians."""

    result: str
    source: str


@dataclass(frozen=True)
class Product:
    """result = left * right, component by component."""

    result: str
    left: str
    """A value or a constant."""
    right: str
    """A value."""


@dataclass(frozen=True)
class Dot:
    """result = scale * (row . source) + bias: one output of a network, a scalar."""

    result: str
    source: str
    row: str
    """A constant."""
    scale: float
    """1 unless the row was rounded (see lower.py)."""
    bias: float


@dataclass(frozen=True)
class Scale:
    """result = factor * source."""

    result: str
    source: str
    factor: float


Op = Affine | Transposed | Sine | Cosine | Product | Dot | Scale
"""`result` is the name of the new value, `source` the name of an earlier one."""


@dataclass(frozen=True)
class Function:
    """Ops in order of execution, from one input to one or more outputs."""

    name: str
    """An identifier, unique in the program."""
    ops: tuple[Op, ...]
    outputs: tuple[str, ...]
    """Names of the returned values."""


@dataclass(frozen=True)
class Cost:
    """The work of one evaluation, padded components included."""

    multiply_adds: int
    sines: int
    """Sines and cosines."""

    def __add__(self, other: "Cost") -> "Cost":
        return Cost(self.multiply_adds + other.multiply_adds, self.sines + other.sines)


@dataclass(frozen=True)
class Band:
    """One level's parameters of sphere tracing; see `Level` in model/model.py."""

    delta: float
    """Band half-width delta, model units (Eq. 3)."""
    iterations: int
    """Steps at this level per round."""
    step_bound: float
    """Factor on the steps, in (0, 1], where this level is the last that is traced."""
    band_step_bound: float
    """Factor on the steps, in (0, 1], where a finer level is traced."""


@dataclass(frozen=True, eq=False)
class Program:
    """A model, lowered to functions and constants (see the top of this file)."""

    name: str
    """The model's name: any text, so generated code must escape it."""
    sha256: str
    """Hash of the model, hexadecimal."""
    bands: tuple[Band, ...]
    """One for each level, the coarsest first."""
    values: tuple[Function, ...]
    """For each level, its network: level 1's distance, or a finer level's residual. Output: f, a scalar."""
    gradients: tuple[Function, ...]
    """For each level, the network's gradient, a vec4 of which x, y and z count, and its value f, a scalar."""
    texture: Function | None
    """The color's network. Outputs: r, g, b, three scalars, sRGB, before the clamp."""
    constants: dict[str, Array]
    """Name -> float32 matrix (rows, columns) or vector (n,), padded."""
    moving: bool = False
    """Whether the input's fourth component is time; otherwise it is 1, for the first layer's bias."""
    composition: "Composition | None" = None
    """Only of a scene, which has no values, gradients and texture of its own."""

    @property
    def coloured(self) -> bool:
        """Whether the program computes colors."""
        return self.texture is not None or self.composition is not None

    def functions(self) -> tuple[Function, ...]:
        """Return all functions: values, then gradients, then the texture."""
        if self.composition is not None:
            return tuple(function for program in self.composition.programs for function in program.functions())
        return (*self.values, *self.gradients, *(() if self.texture is None else (self.texture,)))

    def widest(self, function: Function) -> int:
        """Return the largest side of a function's matrices."""
        products = (op for op in function.ops if isinstance(op, Affine | Transposed))
        return max(int(max(self.constants[op.matrix].shape)) for op in products)

    def widths(self, function: Function) -> dict[str, int]:
        """Return the number of components of each value of a function, input included.

        Raises ValueError where an op refers to an unknown name or to a vector of a wrong width.
        """
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
        """Raise ValueError where the program breaks the rules of this file."""
        for name, constant in self.constants.items():
            if constant.dtype != np.float32 or any(size % 4 for size in constant.shape) or constant.ndim > 2:
                raise ValueError(f"{name}: constants are float32, sizes multiples of 4")
            if not np.isfinite(constant).all():
                raise ValueError(f"{name}: not finite")
        if self.composition is not None:
            if self.values or self.gradients or self.texture is not None:
                raise ValueError("a scene has no functions beside its models'")
            for program in self.composition.programs:
                program.check()
            return
        if not len(self.bands) == len(self.values) == len(self.gradients) > 0:
            raise ValueError("every level needs a band, a value and a gradient")
        signatures = [(function, [1]) for function in self.values]
        signatures += [(function, [4, 1]) for function in self.gradients]
        signatures += [] if self.texture is None else [(self.texture, [1, 1, 1])]
        for function, outputs in signatures:
            widths = self.widths(function)
            if [widths[name] for name in function.outputs] != outputs:
                raise ValueError(f"{function.name}: its outputs are not {outputs} wide")

    def cost(self, function: Function) -> Cost:
        """Count the work of one call of a function."""
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
        """Count the work of each level's value; of a scene, at a point where all its shapes are evaluated."""
        if self.composition is None:
            return tuple(self.cost(function) for function in self.values)
        costs = [Cost(0, 0)] * len(self.bands)
        for leaf in self.composition.leaves:
            if isinstance(leaf.part, Program):
                for i, cost in enumerate(leaf.part.value_costs()[: len(costs)]):
                    costs[i] += cost
        return tuple(costs)

    def _width(self, op: Op, widths: dict[str, int]) -> int:
        """Return the width of an op's result. widths: of the earlier values. Raises ValueError like `widths`."""

        def value(name: str) -> int:
            if name not in widths:
                raise ValueError(f"{op}: {name} is not defined")
            if widths[name] == 1:
                raise ValueError(f"{op}: {name} is a scalar")
            return widths[name]

        def constant(name: str, dimensions: int) -> tuple[int, ...]:
            if name not in self.constants or self.constants[name].ndim != dimensions:
                raise ValueError(f"{op}: {name} is not defined")
            return self.constants[name].shape

        def expect(condition: bool) -> None:
            if not condition:
                raise ValueError(f"{op}: widths differ")

        match op:
            case Affine(source=source, matrix=matrix, bias=bias):
                rows, columns = constant(matrix, 2)
                expect(value(source) == columns and (bias is None or constant(bias, 1) == (rows,)))
                return rows
            case Transposed(source=source, matrix=matrix):
                rows, columns = constant(matrix, 2)
                expect(value(source) == rows)
                return columns
            case Product(left=left, right=right):
                expect((value(left) if left in widths else constant(left, 1)[0]) == value(right))
                return value(right)
            case Dot(source=source, row=row):
                expect(constant(row, 1) == (value(source),))
                return 1
            case _:
                return value(op.source)
