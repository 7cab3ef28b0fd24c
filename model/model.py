"""The model: a sum of nested levels f_{i+1} = f_i + r_i (Section 3.2), a texture, and the place of the shape.

The file format is in model_file.py.
"""

import hashlib
import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .checks import check_finite, check_json, check_network, check_positive
from .errors import UserError
from .orientation import DEFAULT_UP, check_front, check_up
from .scene import Group, check_tree, moves, to_json

LEVEL_KEYS = {"delta": float, "iterations": int, "lipschitz": float}
"""Required keys of the JSON object of a level -> type; see `Level`."""
STEP_BOUNDS = {"step_bound": float, "band_step_bound": float}
"""Optional keys of the JSON object of a level -> type. The default is `DEFAULT_STEP_BOUND`."""
MOST_MODELS = 64
"""Largest number of models of a scene."""
INPUTS = ("xyz", "xyzt")
"""Values of `inputs`: one letter for each number that a network takes."""
LEVEL_OUTPUTS, TEXTURE_OUTPUTS = 1, 3
"""Numbers of outputs of a level's network and of the texture's network."""
MOST_ITERATIONS = 10_000
"""Largest value of a level's `iterations`."""
DELTA_FACTOR = 1.3
"""1 + epsilon of Eq. 5: delta_i is this times the largest |f_i| on the surface."""
DEFAULT_STEP_BOUND = 0.8
"""Factor on the steps of a level without a measured bound."""
DEFAULT_ITERATIONS = (20, 5)
"""Sphere tracing iterations of level 1 and of each finer level of a new model (Section 4)."""

Array = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Layer:
    """One affine layer, y = weight x + bias, with the factor omega_0 of a SIREN multiplied into both (Eq. 2)."""

    weight: Array
    """(out, in) float32."""
    bias: Array
    """(out,) float32."""


Network = tuple[Layer, ...]
"""A SIREN: at least two layers, with a sine after every layer but the last."""


@dataclass(frozen=True, eq=False)
class Level:
    """One level of a model: a network, which is a term of the sum, and numbers for the use of the sum up to it."""

    network: Network
    """f_1 for level 1, the residual r_{i-1} for level i; one output. A scene's levels have no network."""
    delta: float
    """Half-width of the band |f_i| < delta_i in which the next level is defined, model units, above 0 (Eq. 5)."""
    iterations: int
    """Sphere tracing iterations at this level, from 1 to `MOST_ITERATIONS`."""
    lipschitz: float = 1.0
    """Largest measured |grad f_i| where level i is defined, above 0."""
    step_bound: float = DEFAULT_STEP_BOUND
    """Factor on the steps f_i of sphere tracing, in (0, 1], where level i is the last traced level.

    It is the largest factor with which no measured ray passed through the shape.
    """
    band_step_bound: float = DEFAULT_STEP_BOUND
    """Factor on steps towards the band of a finer traced level, f_i - delta_i / DELTA_FACTOR; as `step_bound`."""

    def numbers(self) -> dict[str, float | int]:
        """Return the level's numbers by their keys in the file: `LEVEL_KEYS`, and measured `STEP_BOUNDS`."""
        numbers = {"delta": float(self.delta), "iterations": self.iterations, "lipschitz": float(self.lipschitz)}
        bounds = {key: float(getattr(self, key)) for key in STEP_BOUNDS}
        return numbers | {key: bound for key, bound in bounds.items() if bound != DEFAULT_STEP_BOUND}


@dataclass(frozen=True, eq=False)
class Model:
    """A trained multiscale neural signed distance function, valid by construction: see `validate`.

    In model space, the shape fits the unit sphere. Distances are in model units, negative inside.
    """

    name: str
    """A text, not empty; usually the name of the shape's file."""
    levels: tuple[Level, ...]
    """At least one, the coarsest first."""
    texture: Network | None = None
    """Network from a point in model space to sRGB, to be clamped to [0, 1]; None without colors."""
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Origin of model space in upright input space: input = model * scale + center."""
    scale: float = 1.0
    """Length of the model unit in input space, above 0."""
    up: str = DEFAULT_UP
    """Axis of input space that points up: "x", "y" or "z". In model space it is y (`orientation.upright`)."""
    front: tuple[float, float] | None = None
    """Azimuth and elevation, in degrees, of a camera in front of the shape; None: unknown."""
    credit: str = ""
    """Author and license of the shape; empty: unknown."""
    inputs: str = "xyz"
    """Inputs of the networks: "xyz", a point in model space; or "xyzt", a point and a time, for a moving field."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """Origin of the model, as JSON values: source file, its hash, seed, settings, seconds, errors."""
    shapes: "tuple[Model, ...]" = ()
    """The models of a scene, which are no scenes themselves; empty for a model of one shape."""
    scene: Group | None = None
    """Placement and combination of the shapes, in model space; None for a model of one shape."""

    def __post_init__(self) -> None:
        """Raise UserError if a value is invalid."""
        validate(self)

    @property
    def colored(self) -> bool:
        """Whether the model colors its surface."""
        return self.texture is not None or self.scene is not None

    @property
    def place(self) -> tuple[tuple[float, float, float], float, str]:
        """The center, the scale and the up axis: the place of model space in input space."""
        return self.center, self.scale, self.up

    def networks(self) -> dict[str, Network]:
        """Return the networks by the prefix of their tensors' names: `level1`, ..., `texture`."""
        if self.scene is not None:
            return {
                f"shape{i}.{prefix}": network
                for i, shape in enumerate(self.shapes, start=1)
                for prefix, network in shape.networks().items()
            }
        named = {f"level{i}": level.network for i, level in enumerate(self.levels, start=1)}
        return named | ({} if self.texture is None else {"texture": self.texture})

    def tensors(self) -> dict[str, Array]:
        """Return the tensors by their names in the file."""
        tensors = {}
        for prefix, network in self.networks().items():
            for j, layer in enumerate(network):
                tensors[f"{prefix}.layer{j}.weight"] = layer.weight
                tensors[f"{prefix}.layer{j}.bias"] = layer.bias
        return tensors

    def parameters(self) -> int:
        """Count the weights and biases, including the texture's."""
        return sum(tensor.size for tensor in self.tensors().values())

    def sha256(self) -> str:
        """Hash the tensors and the numbers of each level. Returns 64 hexadecimal digits.

        The hash ignores name, provenance and input space, which do not change a picture.
        """
        digest = hashlib.sha256(json.dumps([level.numbers() for level in self.levels]).encode())
        if self.scene is not None:
            shapes = [(shape.inputs, shape.sha256()) for shape in self.shapes]
            digest.update(json.dumps([shapes, to_json(self.scene)]).encode())
        for name, tensor in self.tensors().items():
            digest.update(name.encode() + repr(tensor.shape).encode() + tensor.tobytes())
        return digest.hexdigest()


SPACES = ("model", "input")
"""Spaces of points: model space, where the shape fits the unit sphere, and the space of the shape's file."""
MODEL_SPACE = ((0.0, 0.0, 0.0), 1.0, DEFAULT_UP)
"""The `Model.place` of a model whose input space is model space."""


def size_text(network: Network) -> str:
    """Describe the size of a network as `NxD` for the paper's (N, d): D hidden layers from N to N numbers."""
    return f"{network[0].weight.shape[0]}x{len(network) - 2}"


def level_networks(model: Model, index: int) -> tuple[Network, ...]:
    """Return the networks of a level, counted from 0: one network, or one for each shape of a scene with that level."""
    return tuple(part.levels[index].network for part in model.shapes or (model,) if index < len(part.levels))


def sizes(networks: tuple[Network, ...]) -> str:
    """Describe the distinct sizes of a level's networks."""
    return "+".join(dict.fromkeys(map(size_text, networks)))


def validate(model: Model) -> None:
    """Check every value of a model. Raises UserError, which names the wrong tensor or key."""
    if not isinstance(model.name, str) or not model.name:
        raise UserError("name: not a text, or empty")
    if model.inputs not in INPUTS:
        raise UserError(f"inputs: {model.inputs!r} is neither 'xyz' nor 'xyzt'")
    for i, coordinate in enumerate(model.center):
        check_finite(f"center[{i}]", coordinate)
    check_positive("scale", model.scale)
    if len(model.center) != 3:
        raise UserError("center: three numbers are needed")
    check_up(model.up)
    if model.front is not None:
        check_front(model.front)
    if not isinstance(model.credit, str):
        raise UserError("credit: not a text")
    check_json("provenance", model.provenance)
    if not model.levels:
        raise UserError("levels: there must be at least one")
    for i, level in enumerate(model.levels, start=1):
        check_positive(f"levels[{i}].delta", level.delta)
        check_positive(f"levels[{i}].lipschitz", level.lipschitz)
        for key in STEP_BOUNDS:
            check_positive(f"levels[{i}].{key}", getattr(level, key))
            if getattr(level, key) > 1:
                raise UserError(f"levels[{i}].{key}: must be at most 1")
        if type(level.iterations) is not int or not 1 <= level.iterations <= MOST_ITERATIONS:
            raise UserError(f"levels[{i}].iterations: must be a whole number from 1 to {MOST_ITERATIONS}")
    if model.scene is not None or model.shapes:
        _validate_scene(model)
        return
    for prefix, network in model.networks().items():
        layers = [(layer.weight, layer.bias) for layer in network]
        outputs = TEXTURE_OUTPUTS if prefix == "texture" else LEVEL_OUTPUTS
        check_network(prefix, layers, len(model.inputs), outputs)


def _validate_scene(model: Model) -> None:
    """Check the values that only a scene has. Raises UserError."""
    if model.scene is None or not 1 <= len(model.shapes) <= MOST_MODELS:
        raise UserError(f"shapes: a scene has from 1 to {MOST_MODELS} models, and other models have none")
    if any(shape.scene is not None for shape in model.shapes):
        raise UserError("shapes: a scene cannot hold a scene")
    if model.texture is not None or any(level.network for level in model.levels):
        raise UserError("levels: a scene has no networks but its shapes'")
    if len(model.levels) > max(len(shape.levels) for shape in model.shapes):
        raise UserError("levels: more levels than any shape")
    check_tree(model.scene, len(model.shapes))
    if moves(model.scene, [shape.inputs == "xyzt" for shape in model.shapes]) != (model.inputs == "xyzt"):
        raise UserError("inputs: must be 'xyzt' for a moving scene, else 'xyz'")
