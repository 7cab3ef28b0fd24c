"""The model and its file: this module is the definition of the format that docs/format.md describes in prose.

A model is a sum of nested levels f_{i+1} = f_i + r_i (Section 3.2), a texture, and the place of the shape in the space
that it came from. A file of it is a safetensors file: `Model.tensors` says which tensors it holds, `MODEL_KEYS` and
`LEVEL_KEYS` say what stands in its metadata, `validate` says which values are allowed. Nothing here needs torch.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save as to_safetensors

from .checks import check_finite, check_json, check_keys, check_network, check_positive, shape_hint
from .errors import UserError
from .files import show, write_whole
from .orientation import DEFAULT_UP, check_front, check_up
from .scene import Group, from_json, moves, to_json

FORMAT = "mplicits"
"""Value of the metadata key `format`."""
VERSION = 2
"""Newest value of the metadata key `version` that this program reads; it writes this one for scenes."""
SHAPE_VERSION = 1
"""Value of the metadata key `version` of a model that is no scene."""
TRAINING = "training"
"""A metadata key, and with a dot after it the beginning of tensors' names: the state of a training that is not over.

Such a file is a model like any other to `load`, which passes over them.
"""
MODEL_KEYS = {"name": str, "levels": list, "inputs": str, "centre": list, "scale": float, "provenance": dict}
"""Keys of the JSON object under the metadata key `model`, and the types of their values; `Model` says what they mean.

A float here and below is any finite JSON number. `levels` is a list of objects with the keys `LEVEL_KEYS`.
"""
LEVEL_KEYS = {"delta": float, "iterations": int, "lipschitz": float}
"""Keys of the JSON object of one level, and the types of their values; `Level` says what they mean.

A level may have the keys `STEP_BOUNDS` as well.
"""
STEP_BOUNDS = {"step_bound": float, "band_step_bound": float}
"""Further keys of the JSON object of one level. A value that is missing, as in older files, is `DEFAULT_STEP_BOUND`."""
OPTIONAL_KEYS = {"up": str, "front": list, "credit": str}
"""Further keys of the JSON object under `model`; a value that is missing is the default of `Model`."""
SCENE_KEYS = {"shapes": list, "scene": dict}
"""Further keys of the JSON object under `model` of a scene, which needs version 2: the objects of its models, whose
tensors' names begin with `shape1.`, `shape2.`, ..., and the tree of scene.py."""
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


Training = tuple[str, Mapping[str, NDArray[Any]]]
"""The state of a training that is not over: JSON for the metadata key `TRAINING`, and tensors by name."""

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
        digest = hashlib.sha256(json.dumps([_level_description(level) for level in self.levels]).encode())
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


def save(model: Model, path: Path, training: Training | None = None) -> None:
    """Write the model file, whole or not at all. Raises UserError where `path` cannot be written.

    training: what the file holds beside the model.
    """
    write_whole(path, to_bytes(model, training=training))


def to_bytes(model: Model, dtype: type[np.floating] = np.float32, training: Training | None = None) -> bytes:
    """Return the model file of a model, the same bytes each time.

    dtype: of the tensors in the file. Only float32 gives a file that `load` reads; a web page carries float16.
    training: what the file holds beside the model.
    """
    tensors: dict[str, NDArray[Any]]
    tensors = {name: np.ascontiguousarray(tensor, dtype) for name, tensor in model.tensors().items()}
    version = SHAPE_VERSION if model.scene is None else VERSION
    metadata = {"format": FORMAT, "version": str(version), "model": json.dumps(_description(model))}
    if training is not None:
        text, state = training
        metadata[TRAINING] = text
        tensors |= {f"{TRAINING}.{name}": np.asarray(tensor, order="C") for name, tensor in state.items()}
    data = to_safetensors(tensors, metadata)
    # safetensors writes the metadata in an order that changes from call to call, so its header is replaced: 8 bytes of
    # length, then JSON padded with spaces to a multiple of 8.
    end = 8 + int.from_bytes(data[:8], "little")
    header = json.dumps({**json.loads(data[8:end]), "__metadata__": metadata}, separators=(",", ":")).encode()
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + data[end:]


def load(path: Path) -> Model:
    """Read and validate a model file.

    Raises UserError, one line that begins with the path, where the file is missing, damaged, or not a model that this
    version reads.
    """
    try:
        if path.exists() and not path.is_file():
            raise UserError("not a file")
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            _check_version(metadata)
            tensors = {}
            for name in file.keys():  # noqa: SIM118 (not a mapping)
                if name.startswith(f"{TRAINING}."):
                    continue
                if file.get_slice(name).get_dtype() != "F32":
                    raise UserError(f"{name}: must be float32")
                tensors[name] = file.get_tensor(name)
        return _from_file(metadata, tensors)
    except FileNotFoundError:
        raise UserError(f"{show(path)}: no such file") from None
    except OSError as error:
        raise UserError(f"{show(path)}: {_one_line(error.strerror or str(error))}") from None
    except SafetensorError as error:
        reason = shape_hint(path) or f"not a model file, or a damaged one ({_one_line(str(error))})"
        raise UserError(f"{show(path)}: {reason}") from None
    except UserError as error:
        raise UserError(f"{show(path)}: {_one_line(str(error))}") from None


def _description(model: Model) -> dict[str, Any]:
    """Return the JSON object of a model: a value for each of MODEL_KEYS, and for OPTIONAL_KEYS where there is one."""
    further = {
        "up": None if model.up == DEFAULT_UP else model.up,
        "front": None if model.front is None else [float(angle) for angle in model.front],
        "credit": model.credit or None,
        "shapes": [_description(shape) for shape in model.shapes] or None,
        "scene": None if model.scene is None else to_json(model.scene),
    }
    return {
        "name": model.name,
        "levels": [_level_description(level) for level in model.levels],
        "inputs": model.inputs,
        "centre": [float(coordinate) for coordinate in model.centre],
        "scale": float(model.scale),
        "provenance": model.provenance,
    } | {key: value for key, value in further.items() if value is not None}


def _level_description(level: Level) -> dict[str, float | int]:
    """Return the JSON object of a level: values for LEVEL_KEYS, and for STEP_BOUNDS that were measured."""
    numbers = {"delta": float(level.delta), "iterations": level.iterations, "lipschitz": float(level.lipschitz)}
    bounds = {key: float(getattr(level, key)) for key in STEP_BOUNDS}
    return numbers | {key: bound for key, bound in bounds.items() if bound != DEFAULT_STEP_BOUND}


def _check_version(metadata: Mapping[str, str]) -> None:
    """Check that a file's metadata is of a model, and of a version that this program reads. Raises UserError."""
    if metadata.get("format") != FORMAT:
        raise UserError("not an mplicits model (metadata key 'format')")
    version = metadata.get("version", "")
    if not re.fullmatch("[1-9][0-9]{0,8}", version):
        raise UserError("metadata key 'version' is not a version number")
    if int(version) > VERSION:
        raise UserError(f"format version {version} is newer than this program reads ({VERSION}); update mplicits")


def _from_file(metadata: Mapping[str, str], tensors: dict[str, Array]) -> Model:
    """Make the model of a file's metadata and tensors; `tensors` is empty afterwards. Raises UserError."""
    description = _read_description(metadata)
    if "scene" in description:
        description |= _take_scene(description, tensors)
    levels = []
    for i, given in enumerate(description["levels"], start=1):
        check_keys(f"levels[{i}]", given, LEVEL_KEYS)
        numbers = dict.fromkeys(STEP_BOUNDS, DEFAULT_STEP_BOUND) | given
        check_keys(f"levels[{i}]", numbers, STEP_BOUNDS)
        network = () if "scene" in description else _take_network(tensors, f"level{i}")
        sizes = (float(numbers[key]) for key in ("lipschitz", *STEP_BOUNDS))
        levels.append(Level(network, float(numbers["delta"]), numbers["iterations"], *sizes))
    texture = _take_network(tensors, "texture") if "texture.layer0.weight" in tensors else None
    if tensors:
        kind = f"a model with {len(levels)} levels"
        raise UserError(f"{min(tensors)}: not a tensor of {kind}, or the layer before it is missing")
    for i, coordinate in enumerate(description["centre"]):
        check_finite(f"centre[{i}]", coordinate)
    if "front" in description:
        check_front(description["front"])
        description["front"] = tuple(float(angle) for angle in description["front"])
    description |= {
        "levels": tuple(levels),
        "texture": texture,
        "centre": tuple(float(coordinate) for coordinate in description["centre"]),
    }
    return Model(**description)


def _take_scene(description: dict[str, Any], tensors: dict[str, Array]) -> dict[str, Any]:
    """Make the shapes and the tree of a scene, and take the shapes' tensors. Raises UserError."""
    shapes = []
    for i, given in enumerate(description["shapes"], start=1):
        prefix = f"shape{i}."
        if not isinstance(given, dict) or "scene" in given:
            raise UserError(f"shapes[{i}]: is not an object of keys and values of one shape")
        own = {name.removeprefix(prefix): tensors.pop(name) for name in sorted(tensors) if name.startswith(prefix)}
        try:
            shapes.append(_from_file({"model": json.dumps(given)}, own))
        except UserError as error:
            raise UserError(f"shapes[{i}]: {error}") from None
    tree = from_json(description["scene"], len(shapes))
    if not isinstance(tree, Group):
        raise UserError("scene: is no group")
    return {"shapes": tuple(shapes), "scene": tree}


def _read_description(metadata: Mapping[str, str]) -> dict[str, Any]:
    """Read the JSON object in a file's metadata: values for MODEL_KEYS and OPTIONAL_KEYS, other keys left out.

    Raises UserError where it is no JSON, or where a value is missing or of another type.
    """
    if "model" not in metadata:
        raise UserError("metadata key 'model' is missing")
    try:
        description = json.loads(metadata["model"], parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise UserError(f"metadata key 'model' is not JSON ({error})") from None
    keys = MODEL_KEYS | {key: kind for key, kind in OPTIONAL_KEYS.items() if key in description}
    if metadata.get("version") == str(VERSION):
        keys |= SCENE_KEYS
    check_keys("metadata key 'model'", description, keys)
    return {key: float(description[key]) if kind is float else description[key] for key, kind in keys.items()}


def _refuse_constant(constant: str) -> None:
    """Refuse NaN and Infinity, which Python's JSON reader would take."""
    raise ValueError(f"{constant} is not a number of JSON")


def _take_network(tensors: dict[str, Array], prefix: str) -> Network:
    """Take the layers 0, 1, ... of a network out of `tensors`, as far as there are any. Raises UserError."""
    layers: list[Layer] = []
    while f"{prefix}.layer{len(layers)}.weight" in tensors:
        name = f"{prefix}.layer{len(layers)}"
        if f"{name}.bias" not in tensors:
            raise UserError(f"{name}.bias: missing")
        layers.append(Layer(tensors.pop(f"{name}.weight"), tensors.pop(f"{name}.bias")))
    return tuple(layers)


def _one_line(text: str) -> str:
    """Escape and shorten a text, some of which may come from the file, so that it fits one line."""
    return show(text)[:300]
