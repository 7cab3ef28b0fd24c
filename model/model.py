"""The model: nested levels f_{i+1} = f_i + r_i (Section 3.2), a texture, the normalisation. Load, save, validate.

docs/format.md describes the file. Nothing here needs torch.
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

from .checks import check_finite, check_json, check_keys, check_network, check_positive
from .errors import UserError
from .files import show, write_whole

FORMAT = "mplicits"
VERSION = 1
MOST_ITERATIONS = 10_000
DEFAULT_ITERATIONS = (20, 5)
"""Sphere tracing iterations of level 1 and of each finer level (Section 4, implementation details)."""

Array = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Layer:
    """y = weight x + bias. weight: (out, in) float32, bias: (out,) float32, omega_0 folded into both (Eq. 2)."""

    weight: Array
    bias: Array


Network = tuple[Layer, ...]
"""A SIREN: sin after every layer but the last."""


@dataclass(frozen=True, eq=False)
class Level:
    """One network of the sum: f1 for the first level, the residual r_{i-1} for level i.

    delta: half width of the band |f_i| < delta_i, model units (Eq. 5).
    iterations: sphere tracing steps at this level.
    lipschitz: largest |grad f_i| measured in the level's domain.
    """

    network: Network
    delta: float
    iterations: int
    lipschitz: float = 1.0


@dataclass(frozen=True, eq=False)
class Model:
    """A trained multiscale neural SDF.

    Model space: the shape fits the unit sphere, distances in its radius, negative inside.
    Input space = model space * scale + centre.
    texture: network from model space to sRGB in [0, 1] (3 outputs), or None.
    inputs: "xyz", or "xyzt" for a field that moves.
    provenance: JSON values (source file name, sha256, seed, settings, seconds, quality figures).
    """

    name: str
    levels: tuple[Level, ...]
    texture: Network | None = None
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale: float = 1.0
    inputs: str = "xyz"
    provenance: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        validate(self)

    def networks(self) -> dict[str, Network]:
        """File prefix -> network, in the file's order."""
        named = {f"level{i}": level.network for i, level in enumerate(self.levels, start=1)}
        return named | ({} if self.texture is None else {"texture": self.texture})

    def tensors(self) -> dict[str, Array]:
        """Tensor name -> array, as the file stores them."""
        tensors = {}
        for prefix, network in self.networks().items():
            for j, layer in enumerate(network):
                tensors[f"{prefix}.layer{j}.weight"] = layer.weight
                tensors[f"{prefix}.layer{j}.bias"] = layer.bias
        return tensors

    def parameters(self) -> int:
        """Number of weights and biases, the texture's included."""
        return sum(tensor.size for tensor in self.tensors().values())

    def sha256(self) -> str:
        """Hash of the weights and the numbers a renderer depends on; name and provenance do not count."""
        digest = hashlib.sha256(json.dumps([level_numbers(level) for level in self.levels]).encode())
        for name, tensor in self.tensors().items():
            digest.update(name.encode() + repr(tensor.shape).encode() + tensor.tobytes())
        return digest.hexdigest()


def shape_of(network: Network) -> str:
    """(N, d) in the paper's notation as `NxD`: width N, D hidden N -> N layers."""
    return f"{network[0].weight.shape[0]}x{len(network) - 2}"


def validate(model: Model) -> None:
    """Raises UserError, one line that names the tensor or key, where `model` breaks docs/format.md."""
    if not isinstance(model.name, str) or not model.name:
        raise UserError("name: not a text, or empty")
    if model.inputs not in ("xyz", "xyzt"):
        raise UserError(f"inputs: {model.inputs!r} is neither 'xyz' nor 'xyzt'")
    for i, coordinate in enumerate(model.centre):
        check_finite(f"centre[{i}]", coordinate)
    check_positive("scale", model.scale)
    if len(model.centre) != 3:
        raise UserError("centre: three numbers are needed")
    check_json("provenance", model.provenance)
    if not model.levels:
        raise UserError("levels: there must be at least one")
    for i, level in enumerate(model.levels, start=1):
        check_positive(f"levels[{i}].delta", level.delta)
        check_positive(f"levels[{i}].lipschitz", level.lipschitz)
        if type(level.iterations) is not int or not 1 <= level.iterations <= MOST_ITERATIONS:
            raise UserError(f"levels[{i}].iterations: must be a whole number from 1 to {MOST_ITERATIONS}")
    for prefix, network in model.networks().items():
        layers = [(layer.weight, layer.bias) for layer in network]
        check_network(prefix, layers, len(model.inputs), 3 if prefix == "texture" else 1)


def save(model: Model, path: Path) -> None:
    """Writes the model file, whole or not at all. Raises UserError where `path` cannot be written."""
    description = {
        "name": model.name,
        "levels": [level_numbers(level) for level in model.levels],
        "inputs": model.inputs,
        "centre": [float(coordinate) for coordinate in model.centre],
        "scale": float(model.scale),
        "provenance": model.provenance,
    }
    write_whole(path, to_bytes(model.tensors(), description))


def to_bytes(tensors: Mapping[str, NDArray[np.floating]], description: dict[str, Any]) -> bytes:
    """The model file of `description`, its JSON; always the same bytes, where safetensors shuffles the metadata."""
    metadata = {"format": FORMAT, "version": str(VERSION), "model": json.dumps(description)}
    data = to_safetensors({name: np.ascontiguousarray(tensor) for name, tensor in tensors.items()}, metadata)
    end = 8 + int.from_bytes(data[:8], "little")
    header = json.dumps({**json.loads(data[8:end]), "__metadata__": metadata}, separators=(",", ":")).encode()
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + data[end:]


def load(path: Path) -> Model:
    """Reads and validates a model file. Raises UserError with one line where it is not a model this version reads."""
    try:
        if path.exists() and not path.is_file():
            raise UserError("not a file")
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            _check_version(metadata)
            tensors = {}
            for name in file.keys():  # noqa: SIM118 (not a mapping)
                if file.get_slice(name).get_dtype() != "F32":
                    raise UserError(f"{name}: must be float32")
                tensors[name] = file.get_tensor(name)
        return _from_file(metadata, tensors)
    except FileNotFoundError:
        raise UserError(f"{show(path)}: no such file") from None
    except OSError as error:
        raise UserError(f"{show(path)}: {_one_line(error.strerror or str(error))}") from None
    except SafetensorError as error:
        raise UserError(f"{show(path)}: not a model file, or a damaged one ({_one_line(str(error))})") from None
    except UserError as error:
        raise UserError(f"{show(path)}: {_one_line(str(error))}") from None


def level_numbers(level: Level) -> dict[str, float | int]:
    return {"delta": float(level.delta), "iterations": level.iterations, "lipschitz": float(level.lipschitz)}


def _check_version(metadata: dict[str, str]) -> None:
    if metadata.get("format") != FORMAT:
        raise UserError("not an mplicits model (metadata key 'format')")
    version = metadata.get("version", "")
    if not re.fullmatch("[1-9][0-9]{0,8}", version):
        raise UserError("metadata key 'version' is not a version number")
    if int(version) > VERSION:
        raise UserError(f"format version {version} is newer than this program reads ({VERSION}); update mplicits")


def _from_file(metadata: dict[str, str], tensors: dict[str, Array]) -> Model:
    """The model of a file's parts; takes its tensors out of `tensors`. Raises UserError."""
    description = _description(metadata)
    levels = []
    for i, numbers in enumerate(description["levels"], start=1):
        check_keys(f"levels[{i}]", numbers, {"delta": float, "iterations": int, "lipschitz": float})
        network = _take_network(tensors, f"level{i}")
        levels.append(Level(network, float(numbers["delta"]), numbers["iterations"], float(numbers["lipschitz"])))
    texture = _take_network(tensors, "texture") if "texture.layer0.weight" in tensors else None
    if tensors:
        model = f"a model with {len(levels)} levels"
        raise UserError(f"{min(tensors)}: not a tensor of {model}, or the layer before it is missing")
    for i, coordinate in enumerate(description["centre"]):
        check_finite(f"centre[{i}]", coordinate)
    description |= {
        "levels": tuple(levels),
        "texture": texture,
        "centre": tuple(float(coordinate) for coordinate in description["centre"]),
    }
    return Model(**description)


def _description(metadata: dict[str, str]) -> dict[str, Any]:
    """The values under the keys that docs/format.md names; other keys are left out."""
    if "model" not in metadata:
        raise UserError("metadata key 'model' is missing")
    try:
        found = json.loads(metadata["model"], parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise UserError(f"metadata key 'model' is not JSON ({error})") from None
    kinds = {"name": str, "levels": list, "inputs": str, "centre": list, "scale": float, "provenance": dict}
    check_keys("metadata key 'model'", found, kinds)
    return {key: float(found[key]) if kind is float else found[key] for key, kind in kinds.items()}


def _refuse_constant(constant: str) -> None:
    raise ValueError(f"{constant} is not a number of JSON")


def _take_network(tensors: dict[str, Array], prefix: str) -> Network:
    layers: list[Layer] = []
    while f"{prefix}.layer{len(layers)}.weight" in tensors:
        name = f"{prefix}.layer{len(layers)}"
        if f"{name}.bias" not in tensors:
            raise UserError(f"{name}.bias: missing")
        layers.append(Layer(tensors.pop(f"{name}.weight"), tensors.pop(f"{name}.bias")))
    return tuple(layers)


def _one_line(text: str) -> str:
    return show(text)[:300]
