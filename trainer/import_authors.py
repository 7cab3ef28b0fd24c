"""Import of checkpoints of the authors' release of the paper (github.com/dsilvavinicius/m-plicits).

A file has one network as an OrderedDict of float32 tensors with the keys `net.{i}.0.weight` (out, in) and
`net.{i}.0.bias`. In best.pth and weights.pth omega_0 is part of the weights, as in our models; in *_with_w0.pth it is
not. Deltas are not stored.
"""

import hashlib
import os
import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from ..model.checks import WIDEST
from ..model.errors import UserError
from ..model.files import show
from ..model.model import Array, Layer, Level, Model, Network
from .field_levels import measured_levels, zero_set
from .networks.network import from_model
from .options import ImportOptions
from .shapes.load import load_shape

UNSCALED = "_with_w0"
"""Part of the name of a file whose weights lack omega_0."""
MOST_WEIGHTS, MOST_LAYERS = 1_000_000, 32
"""Limits of an imported network, to bound the time; the authors' largest has some 640,000 weights in 6 layers."""
_KEY = re.compile(r"^net\.(?:net\.)?(\d{1,4})\.(?:\d{1,4}\.)?(weight|bias)$", re.ASCII)


def read_network(path: Path, omega: float | None) -> Network:
    """Read the network of a .pth file, without running code from it.

    omega: omega_0 of a file that lacks it; None: it is in the weights. Raises UserError where the file is not a
    checkpoint of the authors.
    """
    label = show(path.name)
    if not os.path.isfile(path):  # Path.is_file raises where a name is too long.
        raise UserError(f"{show(path)}: no such file")
    try:
        with warnings.catch_warnings(action="ignore"):
            state = torch.load(path, map_location="cpu", weights_only=True)
    except Exception:  # torch raises anything on damaged files
        raise UserError(f"{label}: not a checkpoint that is readable without running code from it") from None
    layers: dict[int, dict[str, np.ndarray]] = {}
    for key, tensor in state.items() if isinstance(state, dict) else ():
        match, array = _KEY.match(str(key)), _finite_array(tensor)
        if match is None or array is None:
            raise UserError(f"{label}: {show(str(key)[:60])}: not a weight of the authors' networks, or not finite")
        pair = layers.setdefault(int(match[1]), {})
        if match[2] in pair:
            raise UserError(f"{label}: {show(str(key)[:60])}: duplicate {match[2]} of layer {int(match[1])}")
        pair[match[2]] = array
    if len(layers) < 2 or any(len(pair) != 2 for pair in layers.values()):
        raise UserError(f"{label}: no layers net.0.0.weight, net.0.0.bias, ... in it")
    count = sum(array.size for pair in layers.values() for array in pair.values())
    if count > MOST_WEIGHTS or len(layers) > MOST_LAYERS:
        raise UserError(
            f"{label}: {count:,} weights in {len(layers)} layers; at most {MOST_WEIGHTS:,} in {MOST_LAYERS} are allowed"
        )
    if UNSCALED in path.stem and omega is None:
        raise UserError(f"{label}: its weights lack omega_0; name it with --omega (config.yaml beside the file has it)")
    factor = 1.0 if omega is None else omega
    pairs = [layers[index] for index in sorted(layers)]
    return (
        *(Layer(_scaled(pair["weight"], factor), _scaled(pair["bias"], factor)) for pair in pairs[:-1]),
        Layer(pairs[-1]["weight"], pairs[-1]["bias"]),
    )


def _finite_array(tensor: object) -> Array | None:
    """Return the float32 array of a dense tensor of finite numbers of a layer's size; None for everything else."""
    if (
        not isinstance(tensor, Tensor)
        or tensor.is_nested
        or tensor.layout != torch.strided
        or tensor.is_meta
        or not tensor.dtype.is_floating_point
        or not 1 <= tensor.ndim <= 2
        or max(tensor.shape) > WIDEST
        or not torch.isfinite(tensor).all()
    ):
        return None
    array: Array = tensor.detach().float().numpy()
    return array


def _scaled(array: Array, factor: float) -> Array:
    """Multiply an array by omega_0. An overflow is refused later as not finite."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(np.float32(factor) * array)


def import_checkpoints(paths: Sequence[Path], options: ImportOptions) -> Model:
    """Return a model of the checkpoints `paths`, coarse to fine.

    The points of `options.shape` give the deltas (Eq. 5), and its place becomes the model's; without a shape, the zero
    level set of the last level gives the deltas. Raises UserError.
    """
    if not paths:
        raise UserError("checkpoints: name one file or more")
    omegas, shape = options.omegas(len(paths)), options.shape
    names = ", ".join(show(path.name) for path in paths)
    networks = [read_network(path, omega) for path, omega in zip(paths, omegas, strict=True)]
    # Check each file separately, so that the error names the file.
    for path, network in zip(paths, networks, strict=True):
        try:
            Model("checkpoint", (Level(network, 1.0, 1),))
        except UserError as error:
            raise UserError(f"{show(path.name)}: {error}") from None
    levels = [from_model(network) for network in networks]
    try:
        points = zero_set(levels)
    except UserError as error:
        advice = "are these checkpoints of one shape, coarse to fine, and is --omega right?"
        raise UserError(f"{names}: {error}; {advice}") from None
    loaded = None if shape is None else load_shape(str(shape), follow=options.follow)[0]
    surface = points if loaded is None else torch.from_numpy(loaded.inputs().astype(np.float32))
    return _model(
        names,
        name=paths[-1].stem if loaded is None else loaded.name,
        levels=measured_levels(networks, surface, points),
        center=(0.0, 0.0, 0.0) if loaded is None else loaded.center,
        scale=1.0 if loaded is None else loaded.scale,
        provenance={
            "checkpoints": [
                {"file": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest(), "omega": omega}
                for path, omega in zip(paths, omegas, strict=True)
            ],
            "source": None if loaded is None else loaded.source,
        },
        front=options.view(),
        credit=options.credit or "",
    )


def _model(names: str, **fields: Any) -> Model:
    """Return the model. Raises UserError with the files' names, where a measured value is not finite."""
    try:
        return Model(**fields)
    except UserError as error:
        raise UserError(f"{names}: {error}") from None
