"""The model: nested levels f_{i+1} = f_i + r_i (Section 3.2), a texture, the normalisation. Load, save, validate.

docs/format.md describes the file. Nothing here needs torch.
"""

import dataclasses
import hashlib
import json
import math
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save as to_safetensors

from .errors import UserError
from .files import show, write_whole

FORMAT = "mplicits"
VERSION = 1
WIDEST = 4096
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
        digest = hashlib.sha256(json.dumps([_level_numbers(level) for level in self.levels]).encode())
        for name, tensor in self.tensors().items():
            digest.update(name.encode() + repr(tensor.shape).encode() + tensor.tobytes())
        return digest.hexdigest()


def shape_of(network: Network) -> str:
    """(N, d) in the paper's notation as `NxD`: width N, D hidden N -> N layers."""
    return f"{network[0].weight.shape[0]}x{len(network) - 2}"


def validate(model: Model) -> None:
    """Raises UserError, one line that names the tensor or key, where `model` breaks docs/format.md."""
    if model.inputs not in ("xyz", "xyzt"):
        raise UserError(f"inputs: {model.inputs!r} is neither 'xyz' nor 'xyzt'")
    if not isinstance(model.name, str) or not model.name:
        raise UserError("name: not a text, or empty")
    if not model.levels:
        raise UserError("levels: there must be at least one")
    for key, value in (("scale", model.scale), *((f"centre[{i}]", c) for i, c in enumerate(model.centre))):
        _finite(key, value)
    if len(model.centre) != 3 or model.scale <= 0:
        raise UserError("centre, scale: three numbers and a positive one are needed")
    for i, level in enumerate(model.levels, start=1):
        for key in ("delta", "lipschitz"):
            _finite(f"levels[{i}].{key}", getattr(level, key))
            if getattr(level, key) <= 0:
                raise UserError(f"levels[{i}].{key}: must be positive")
        if not isinstance(level.iterations, int) or not 1 <= level.iterations <= 10_000:
            raise UserError(f"levels[{i}].iterations: must be a whole number from 1 to 10000")
    for prefix, network in model.networks().items():
        _validate_network(prefix, network, len(model.inputs), 3 if prefix == "texture" else 1)


def save(model: Model, path: Path) -> None:
    """Writes the model file, whole or not at all. Raises UserError where `path` cannot be written."""
    description = {
        "name": model.name,
        "levels": [_level_numbers(level) for level in model.levels],
        "inputs": model.inputs,
        "centre": list(model.centre),
        "scale": model.scale,
        "provenance": model.provenance,
    }
    metadata = {"format": FORMAT, "version": str(VERSION), "model": json.dumps(description)}
    tensors = {name: np.ascontiguousarray(tensor) for name, tensor in model.tensors().items()}
    write_whole(path, to_safetensors(tensors, metadata))


def load(path: Path) -> Model:
    """Reads and validates a model file. Raises UserError with one line where it is not a model this version reads."""
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            _check_version(metadata)
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (not a mapping)
        return _from_file(metadata, tensors)
    except FileNotFoundError:
        raise UserError(f"{show(path)}: no such file") from None
    except OSError as error:
        raise UserError(f"{show(path)}: {error.strerror or error}") from None
    except (SafetensorError, struct.error) as error:
        raise UserError(f"{show(path)}: not a model file, or a damaged one ({_one_line(error)})") from None
    except UserError as error:
        raise UserError(f"{show(path)}: {error}") from None


def _level_numbers(level: Level) -> dict[str, float | int]:
    return {"delta": level.delta, "iterations": level.iterations, "lipschitz": level.lipschitz}


def _check_version(metadata: dict[str, str]) -> None:
    if metadata.get("format") != FORMAT:
        raise UserError("not an mplicits model (metadata key 'format')")
    version = metadata.get("version", "")
    if not version.isdecimal():
        raise UserError("metadata key 'version' is not a number")
    if int(version) > VERSION:
        raise UserError(f"format version {int(version)} is newer than this program reads ({VERSION}); update mplicits")


def _from_file(metadata: dict[str, str], tensors: dict[str, Array]) -> Model:
    try:
        description = json.loads(metadata["model"])
        levels = tuple(
            Level(_take_network(tensors, f"level{i}"), float(numbers["delta"]), numbers["iterations"],
                  float(numbers.get("lipschitz", 1.0)))
            for i, numbers in enumerate(description["levels"], start=1)
        )
        texture = _take_network(tensors, "texture") if "texture.layer0.weight" in tensors else None
        x, y, z = description["centre"]
        model = Model(
            name=description["name"], levels=levels, texture=texture, inputs=description["inputs"],
            centre=(float(x), float(y), float(z)), scale=float(description["scale"]),
            provenance=dict(description["provenance"]),
        )
    except KeyError as error:
        raise UserError(f"metadata: key {error} is missing") from None
    except (json.JSONDecodeError, TypeError, ValueError, RecursionError) as error:
        raise UserError(f"metadata key 'model' is not as docs/format.md says ({_one_line(error)})") from None
    if tensors:
        raise UserError(f"{show(min(tensors))}: no such tensor in the format, or a layer before it is missing")
    return model


def _take_network(tensors: dict[str, Array], prefix: str) -> Network:
    layers = []
    while f"{prefix}.layer{len(layers)}.weight" in tensors:
        name = f"{prefix}.layer{len(layers)}"
        if f"{name}.bias" not in tensors:
            raise UserError(f"{name}.bias: missing")
        layers.append(Layer(tensors.pop(f"{name}.weight"), tensors.pop(f"{name}.bias")))
    return tuple(layers)


def _validate_network(prefix: str, network: Network, inputs: int, outputs: int) -> None:
    if len(network) < 2:
        raise UserError(f"{prefix}: needs at least two layers (layer0, layer1)")
    width = inputs
    for j, layer in enumerate(network):
        name = f"{prefix}.layer{j}"
        for key, tensor in dataclasses.asdict(layer).items():
            if not isinstance(tensor, np.ndarray) or tensor.dtype != np.float32:
                raise UserError(f"{name}.{key}: must be float32")
            if not np.isfinite(tensor).all():
                raise UserError(f"{name}.{key}: has values that are not finite")
        if layer.weight.ndim != 2 or layer.weight.shape[1] != width:
            raise UserError(f"{name}.weight: shape {layer.weight.shape}, expected (out, {width})")
        width = layer.weight.shape[0]
        if not 1 <= width <= WIDEST:
            raise UserError(f"{name}.weight: {width} outputs, expected 1 to {WIDEST}")
        if layer.bias.shape != (width,):
            raise UserError(f"{name}.bias: shape {layer.bias.shape}, expected ({width},)")
    if width != outputs:
        raise UserError(f"{prefix}.layer{len(network) - 1}.weight: {width} outputs, expected {outputs}")


def _finite(key: str, value: float) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise UserError(f"{key}: must be a finite number")


def _one_line(error: Exception) -> str:
    return show(str(error).splitlines()[0] if str(error) else type(error).__name__)[:200]
