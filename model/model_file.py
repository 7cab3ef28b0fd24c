"""The file of a model, a safetensors file: the definition of the format that docs/format.md describes.

`Model.tensors` lists the tensors, `MODEL_KEYS` and `LEVEL_KEYS` list the metadata, and `validate` checks the values.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save as to_safetensors

from .checks import check_finite, check_keys, shape_hint
from .errors import UserError
from .files import show, write_whole
from .model import DEFAULT_STEP_BOUND, LEVEL_KEYS, STEP_BOUNDS, Array, Layer, Level, Model, Network
from .orientation import DEFAULT_UP, check_front
from .packed_weights import pack, sizes_of, unpack
from .scene import Group, from_json, to_json

FORMAT = "mplicits"
"""Value of the metadata key `format`."""
VERSION = 3
"""Newest readable value of the metadata key `version`; the value for packed weights (packed_weights.py)."""
SCENE_VERSION = 2
"""Value of the metadata key `version` for scenes."""
SHAPE_VERSION = 1
"""Value of the metadata key `version` for models of one shape."""
PACKED = "packed"
"""Name of the tensor of packed weights, and of the key under `model` with the sizes of the networks."""
TRAINING = "training"
"""Metadata key, and prefix of tensors' names (with a dot), of the state of an interrupted training. `load` skips it."""
# Keys of files keep their spelling.
MODEL_KEYS = {"name": str, "levels": list, "inputs": str, "centre": list, "scale": float, "provenance": dict}
"""Required keys of the JSON object under the metadata key `model` -> type; see `Model`.

A float is any finite JSON number. `levels` is a list of objects with the keys `LEVEL_KEYS`.
"""
OPTIONAL_KEYS = {"up": str, "front": list, "credit": str}
"""Optional keys of the JSON object under `model` -> type; `Model` has the defaults."""
SCENE_KEYS = {"shapes": list, "scene": dict}
"""Further keys of a scene -> type: the objects of its models, and the tree of scene.py.

The names of the models' tensors begin with `shape1.`, `shape2.`, ...
"""

Training = tuple[str, Mapping[str, NDArray[Any]]]
"""State of an interrupted training: JSON for the metadata key `TRAINING`, and tensors by name."""


def save(model: Model, path: Path, training: Training | None = None) -> None:
    """Write the file of a model, whole or not at all. Raises UserError if `path` is not writable."""
    write_whole(path, to_bytes(model, training=training))


def to_bytes(model: Model, dtype: type[np.floating] = np.float32, training: Training | None = None) -> bytes:
    """Return the bytes of a model's file; equal models give equal bytes.

    dtype: type of the tensors. `load` reads float32 alone; a web page carries float16. Weights that are multiples of
    steps, as `mplicits pack` makes them, are packed.
    """
    tensors: dict[str, NDArray[Any]]
    description, networks = _description(model), model.networks()
    packed = pack(networks)
    if packed is None:
        tensors = {name: np.ascontiguousarray(tensor, dtype) for name, tensor in model.tensors().items()}
        version = SHAPE_VERSION if model.scene is None else SCENE_VERSION
    else:
        tensors = {PACKED: np.frombuffer(packed, np.uint8)}
        description[PACKED] = {prefix: sizes_of(network) for prefix, network in networks.items()}
        version = VERSION
    metadata = {"format": FORMAT, "version": str(version), "model": json.dumps(description)}
    if training is not None:
        text, state = training
        metadata[TRAINING] = text
        tensors |= {f"{TRAINING}.{name}": np.asarray(tensor, order="C") for name, tensor in state.items()}
    data = to_safetensors(tensors, metadata)
    # safetensors writes the metadata in random order. Replace its header: 8 bytes of length, then JSON that is padded
    # with spaces to a multiple of 8.
    end = 8 + int.from_bytes(data[:8], "little")
    header = json.dumps({**json.loads(data[8:end]), "__metadata__": metadata}, separators=(",", ":")).encode()
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + data[end:]


def load(path: Path) -> Model:
    """Read and validate the file of a model.

    Raises UserError, which begins with the path, if the file is missing, damaged, no model, or of a newer version.
    """
    try:
        if path.exists() and not path.is_file():
            raise UserError("not a file")
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            _check_version(metadata)
            tensors: dict[str, NDArray[Any]] = {}
            for name in file.keys():  # noqa: SIM118 (not a mapping)
                if name.startswith(f"{TRAINING}."):
                    continue
                is_packed = name == PACKED and metadata["version"] == str(VERSION)
                if file.get_slice(name).get_dtype() != ("U8" if is_packed else "F32"):
                    raise UserError(f"{name}: must be {'bytes' if is_packed else 'float32'}")
                tensors[name] = file.get_tensor(name)
        if metadata["version"] == str(VERSION):
            tensors = _unpacked(metadata, tensors)
        return _from_file(metadata, tensors)
    except FileNotFoundError:  # safetensors also raises it for a file that others may not read
        raise UserError(f"{show(path)}: {'permission denied' if path.exists() else 'no such file'}") from None
    except OSError as error:
        raise UserError(f"{show(path)}: {_one_line(error.strerror or str(error))}") from None
    except SafetensorError as error:
        reason = shape_hint(path) or f"not a model file, or a damaged one ({_one_line(str(error))})"
        raise UserError(f"{show(path)}: {reason}") from None
    except UserError as error:
        raise UserError(f"{show(path)}: {_one_line(str(error))}") from None


def _description(model: Model) -> dict[str, Any]:
    """Return the JSON object of a model: MODEL_KEYS, and the OPTIONAL_KEYS that differ from the default."""
    further = {
        "up": None if model.up == DEFAULT_UP else model.up,
        "front": None if model.front is None else [float(angle) for angle in model.front],
        "credit": model.credit or None,
        "shapes": [_description(shape) for shape in model.shapes] or None,
        "scene": None if model.scene is None else to_json(model.scene),
    }
    return {
        "name": model.name,
        "levels": [level.numbers() for level in model.levels],
        "inputs": model.inputs,
        "centre": [float(coordinate) for coordinate in model.center],
        "scale": float(model.scale),
        "provenance": model.provenance,
    } | {key: value for key, value in further.items() if value is not None}


def _check_version(metadata: Mapping[str, str]) -> None:
    """Check the format and the version in a file's metadata. Raises UserError."""
    if metadata.get("format") != FORMAT:
        raise UserError("not an mplicits model (metadata key 'format')")
    version = metadata.get("version", "")
    if not re.fullmatch("[1-9][0-9]{0,8}", version):
        raise UserError("metadata key 'version' is not a version number")
    if int(version) > VERSION:
        raise UserError(f"format version {version} is newer than this program reads ({VERSION}); update mplicits")


def _from_file(metadata: Mapping[str, str], tensors: dict[str, Array]) -> Model:
    """Build a model from metadata and tensors, and empty `tensors`. Raises UserError."""
    description = _read_description(metadata)
    if "scene" in description:
        description |= _take_scene(description, tensors)
    levels = []
    for i, entry in enumerate(description["levels"], start=1):
        check_keys(f"levels[{i}]", entry, LEVEL_KEYS)
        numbers = dict.fromkeys(STEP_BOUNDS, DEFAULT_STEP_BOUND) | entry
        check_keys(f"levels[{i}]", numbers, STEP_BOUNDS)
        network = () if "scene" in description else _take_network(tensors, f"level{i}")
        sizes = (float(numbers[key]) for key in ("lipschitz", *STEP_BOUNDS))
        levels.append(Level(network, float(numbers["delta"]), numbers["iterations"], *sizes))
    texture = _take_network(tensors, "texture") if "texture.layer0.weight" in tensors else None
    if tensors:
        raise UserError(
            f"{min(tensors)}: not a tensor of a model with {len(levels)} levels, or the layer before it is missing"
        )
    center = description.pop("centre")
    if len(center) != 3:
        raise UserError("centre: three numbers are needed")
    for i, coordinate in enumerate(center):
        check_finite(f"centre[{i}]", coordinate)
    if "front" in description:
        check_front(description["front"])
        description["front"] = tuple(float(angle) for angle in description["front"])
    description |= {
        "levels": tuple(levels),
        "texture": texture,
        "center": tuple(float(coordinate) for coordinate in center),
    }
    return Model(**description)


def _take_scene(description: dict[str, Any], tensors: dict[str, Array]) -> dict[str, Any]:
    """Build the shapes and the tree of a scene, and remove the shapes' tensors from `tensors`. Raises UserError."""
    shapes = []
    for i, entry in enumerate(description["shapes"], start=1):
        prefix = f"shape{i}."
        if not isinstance(entry, dict) or "scene" in entry:
            raise UserError(f"shapes[{i}]: is not an object of keys and values of one shape")
        own = {name.removeprefix(prefix): tensors.pop(name) for name in sorted(tensors) if name.startswith(prefix)}
        try:
            shapes.append(_from_file({"model": json.dumps(entry)}, own))
        except UserError as error:
            raise UserError(f"shapes[{i}]: {error}") from None
    tree = from_json(description["scene"], len(shapes))
    if not isinstance(tree, Group):
        raise UserError("scene: is not a group")
    return {"shapes": tuple(shapes), "scene": tree}


def _json(metadata: Mapping[str, str]) -> dict[str, Any]:
    """Parse the JSON object in a file's metadata. Raises UserError."""
    if "model" not in metadata:
        raise UserError("metadata key 'model' is missing")
    try:
        description = json.loads(metadata["model"], parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise UserError(f"metadata key 'model' is not JSON ({error})") from None
    check_keys("metadata key 'model'", description, {})
    return dict(description)


def _read_description(metadata: Mapping[str, str]) -> dict[str, Any]:
    """Parse the JSON object in a file's metadata; unknown keys are dropped.

    Raises UserError if it is no JSON, or if a value is missing or has a wrong type.
    """
    description = _json(metadata)
    optional = OPTIONAL_KEYS | (SCENE_KEYS if metadata.get("version") == str(VERSION) else {})
    keys = MODEL_KEYS | {key: kind for key, kind in optional.items() if key in description}
    if metadata.get("version") == str(SCENE_VERSION) or SCENE_KEYS.keys() & keys.keys():
        keys |= SCENE_KEYS
    check_keys("metadata key 'model'", description, keys)
    return {key: float(description[key]) if kind is float else description[key] for key, kind in keys.items()}


def _unpacked(metadata: Mapping[str, str], tensors: dict[str, NDArray[Any]]) -> dict[str, Array]:
    """Take the packed weights out of `tensors`, and return the tensors that they hold. Raises UserError."""
    sizes = _json(metadata).get(PACKED)
    if PACKED not in tensors or not isinstance(sizes, dict):
        raise UserError(f"{PACKED}: the tensor or the sizes of the networks are missing")
    data = tensors.pop(PACKED).tobytes()
    if tensors:
        raise UserError(f"{min(tensors)}: a tensor beside the packed ones")
    return unpack(sizes, data)


def _refuse_constant(constant: str) -> None:
    """Refuse NaN and Infinity, which Python's JSON parser accepts."""
    raise ValueError(f"{constant} is not a number of JSON")


def _take_network(tensors: dict[str, Array], prefix: str) -> Network:
    """Move the layers 0, 1, ... of a network out of `tensors`. Raises UserError."""
    layers: list[Layer] = []
    while f"{prefix}.layer{len(layers)}.weight" in tensors:
        name = f"{prefix}.layer{len(layers)}"
        if f"{name}.bias" not in tensors:
            raise UserError(f"{name}.bias: missing")
        layers.append(Layer(tensors.pop(f"{name}.weight"), tensors.pop(f"{name}.bias")))
    return tuple(layers)


def _one_line(text: str) -> str:
    """Escape and shorten a text that may come from the file."""
    return show(text)[:300]
