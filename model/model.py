"""The model: a sum of nested levels f_{i+1} = f_i + r_i (Section 3.2), a texture, and the place of the shape.

What its file holds stands in model_file.py.
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
from .scene import Group, moves, to_json

LEVEL_KEYS = {"delta": float, "iterations": int, "lipschitz": float}
"""Keys of the JSON object of one level, and the types of their values; `Level` says what they mean.

A level may have the keys `STEP_BOUNDS` as well.
"""
STEP_BOUNDS = {"step_bound": float, "band_step_bound": float}
"""Further keys of the JSON object of one level. A value that is missing, as in older files, is `DEFAULT_STEP_BOUND`."""
MOST_MODELS = 64
"""Most models of a scene."""
INPUTS = ("xyz", "xyzt")
"""Values of `inputs`: a network takes as many numbers as the text has letters."""
LEVEL_OUTPUTS, TEXTURE_OUTPUTS = 1, 3
"""How many numbers a level's network and the texture's network give."""
MOST_ITERATIONS = 10_000
"""Largest value of a level's `iterations`."""
DEFAULT_STEP_BOUND = 0.8
"""Factor on a level's steps where nothing was measured."""
DEFAULT_ITERATIONS = (20, 5)
"""Sphere tracing iterations that training gives to level 1 and to each finer level (Section 4)."""

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
    """One level of a model: its network is a term of the sum, and the rest says where and how its sum is used."""

    network: Network
    """f_1 for the first level, the residual r_{i-1} for level i. It gives one number. A scene's levels have none."""
    delta: float
    """Half the width of the band |f_i| < delta_i in which the next level is defined, model units, above 0 (Eq. 5)."""
    iterations: int
    """Sphere tracing iterations at this level, from 1 to `MOST_ITERATIONS`."""
    lipschitz: float = 1.0
    """Largest |grad f_i| that was measured where level i is defined, above 0."""
    step_bound: float = DEFAULT_STEP_BOUND
    """Largest factor on sphere tracing's steps f_i, level i being the last that is traced, in (0, 1].

    With it, no ray that was measured passed through the shape.
    """
    band_step_bound: float = DEFAULT_STEP_BOUND
    """The same for the steps towards the band, f_i - delta_i / 1.3, where a finer level is traced."""

    def numbers(self) -> dict[str, float | int]:
        """Return the level's numbers by the keys of the file: `LEVEL_KEYS`, and `STEP_BOUNDS` that were measured."""
        numbers = {"delta": float(self.delta), "iterations": self.iterations, "lipschitz": float(self.lipschitz)}
        bounds = {key: float(getattr(self, key)) for key in STEP_BOUNDS}
        return numbers | {key: bound for key, bound in bounds.items() if bound != DEFAULT_STEP_BOUND}


@dataclass(frozen=True, eq=False)
class Model:
    """A trained multiscale neural signed distance function, valid by construction: see `validate`.

    Model space is where the shape fits the unit sphere. Distances are in its radius, and negative inside.
    """

    name: str
    """Any text that is not empty, usually the name of the file that the shape came from."""
    levels: tuple[Level, ...]
    """At least one, the coarsest first."""
    texture: Network | None = None
    """From a point in model space to a colour: 3 numbers, sRGB in [0, 1], to be clamped. None for no colours."""
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where model space's origin lies in input space turned upright, which is model space * scale + centre."""
    scale: float = 1.0
    """Length of model space's unit in input space, above 0."""
    up: str = DEFAULT_UP
    """Axis of input space that points up, "x", "y" or "z"; in model space it is y (`orientation.upright`)."""
    front: tuple[float, float] | None = None
    """Azimuth and elevation, in degrees, of a camera that sees the shape as it wants to be seen; None: not known."""
    credit: str = ""
    """Author and licence of the shape, any text; empty where they are not known."""
    inputs: str = "xyz"
    """What the networks take: "xyz", a point in model space, or "xyzt", a point and a time, for a field that moves."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """Where the model comes from, as JSON values: source file, its hash, seed, settings, seconds, quality figures."""
    shapes: "tuple[Model, ...]" = ()
    """The models of a scene, none of which is a scene; none in a model of one shape."""
    scene: Group | None = None
    """How the shapes are placed and joined, in model space; None where there are none."""

    def __post_init__(self) -> None:
        """Refuse what is no valid model. Raises UserError."""
        validate(self)

    @property
    def coloured(self) -> bool:
        """Whether the surface has colours of its own."""
        return self.texture is not None or self.scene is not None

    @property
    def place(self) -> tuple[tuple[float, float, float], float, str]:
        """The centre, the scale and the axis that is up: where model space lies in input space."""
        return self.centre, self.scale, self.up

    def networks(self) -> dict[str, Network]:
        """Return the prefix of each network's tensor names, `level1`, ... and `texture`, and that network."""
        if self.scene is not None:
            return {
                f"shape{i}.{prefix}": network
                for i, shape in enumerate(self.shapes, start=1)
                for prefix, network in shape.networks().items()
            }
        named = {f"level{i}": level.network for i, level in enumerate(self.levels, start=1)}
        return named | ({} if self.texture is None else {"texture": self.texture})

    def tensors(self) -> dict[str, Array]:
        """Return the name of each tensor of the file, and that tensor."""
        tensors = {}
        for prefix, network in self.networks().items():
            for j, layer in enumerate(network):
                tensors[f"{prefix}.layer{j}.weight"] = layer.weight
                tensors[f"{prefix}.layer{j}.bias"] = layer.bias
        return tensors

    def parameters(self) -> int:
        """Count the weights and biases, those of the texture included."""
        return sum(tensor.size for tensor in self.tensors().values())

    def sha256(self) -> str:
        """Hash the tensors and the numbers of each level: what a renderer depends on. Returns 64 hexadecimal digits.

        Two models that differ in name, provenance or input space alone have the same hash.
        """
        digest = hashlib.sha256(json.dumps([level.numbers() for level in self.levels]).encode())
        if self.scene is not None:
            shapes = [(shape.inputs, shape.sha256()) for shape in self.shapes]
            digest.update(json.dumps([shapes, to_json(self.scene)]).encode())
        for name, tensor in self.tensors().items():
            digest.update(name.encode() + repr(tensor.shape).encode() + tensor.tobytes())
        return digest.hexdigest()


MODEL_SPACE = ((0.0, 0.0, 0.0), 1.0, DEFAULT_UP)
"""The `Model.place` of a model whose input space is model space."""


def shape_of(network: Network) -> str:
    """Name a network's size as the paper's (N, d), written `NxD`: width N, and D hidden layers of N to N numbers."""
    return f"{network[0].weight.shape[0]}x{len(network) - 2}"


def level_networks(model: Model, index: int) -> tuple[Network, ...]:
    """Return the networks of a level, counted from 0: one, or of a scene those of the models that have such a level."""
    return tuple(part.levels[index].network for part in model.shapes or (model,) if index < len(part.levels))


def sizes(networks: tuple[Network, ...]) -> str:
    """Name the sizes of a level's networks, each size once."""
    return "+".join(dict.fromkeys(map(shape_of, networks)))


def validate(model: Model) -> None:
    """Check every value of a model. Raises UserError, one line that names the tensor or key that is wrong."""
    if not isinstance(model.name, str) or not model.name:
        raise UserError("name: not a text, or empty")
    if model.inputs not in INPUTS:
        raise UserError(f"inputs: {model.inputs!r} is neither 'xyz' nor 'xyzt'")
    for i, coordinate in enumerate(model.centre):
        check_finite(f"centre[{i}]", coordinate)
    check_positive("scale", model.scale)
    if len(model.centre) != 3:
        raise UserError("centre: three numbers are needed")
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
    """Check what a scene has beside the values of every model. Raises UserError."""
    if model.scene is None or not 1 <= len(model.shapes) <= MOST_MODELS:
        raise UserError(f"shapes: a scene has from 1 to {MOST_MODELS} models, and other models have none")
    if any(shape.scene is not None for shape in model.shapes):
        raise UserError("shapes: a scene is none")
    if model.texture is not None or any(level.network for level in model.levels):
        raise UserError("levels: a scene has no networks beside its shapes'")
    if len(model.levels) > max(len(shape.levels) for shape in model.shapes):
        raise UserError("levels: there are more than any shape has")
    if moves(model.scene, [shape.inputs == "xyzt" for shape in model.shapes]) != (model.inputs == "xyzt"):
        raise UserError("inputs: must be 'xyzt' where the scene moves, and 'xyz' where it does not")
