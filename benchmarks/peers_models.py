"""The models of benchmarks/peers.py: ours, and one SIREN; their files, texts and pages, and the surfaces of these."""

import gzip
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from mplicits.bake.registry import TARGETS
from mplicits.codegen.targets import shadertoy
from mplicits.codegen.targets.shadertoy_text import shader_text
from mplicits.field import interpret
from mplicits.field.bits import fewest_bits
from mplicits.field.pack import packed
from mplicits.ir.lower import lower
from mplicits.mesher.extract import extract_model
from mplicits.mesher.surface_line import loose_components
from mplicits.model import gallery
from mplicits.model.model import Model, size_text
from mplicits.model.model_file import load, save, to_bytes
from mplicits.readers.values import Doubles, Integers
from mplicits.trainer import settings
from mplicits.trainer.progress import TrainingBar
from mplicits.trainer.settings import PRESETS, Settings
from mplicits.trainer.shapes.shape import Shape
from mplicits.trainer.suited_omegas import suited_omegas
from mplicits.trainer.train import Training
from mplicits.web import tiny_page
from mplicits.web.weights import short_weights
from peers_surface import Surface

STEPS = (1000, 2000)
"""Optimizer steps of level 1, and of level 2."""
SIREN = (96, 2)
"""Width and depth of the one SIREN: about as many weights as the preset `base`."""
SIREN_OMEGA = 60.0
SIZES = {name: PRESETS[name].levels for name in ("small", "base")}
"""Name of a model's size -> its levels."""
GRID = 384
"""Cells along each side of the grid that a model's mesh is extracted from."""


@dataclass(frozen=True)
class Result:
    """A file of a method, and the surface that it stands for."""

    method: str
    setting: str
    size: int
    """Bytes."""
    surface: Surface


@dataclass(frozen=True, eq=False)
class Named:
    """A model of a shape."""

    key: str
    """Name of its file."""
    setting: str
    """What the page calls it."""
    model: Model


def surface_of(model: Model) -> Surface:
    """Return the surface of a model: its extracted mesh, with the field's own normals and colors."""
    mesh = extract_model(replace(model, texture=None), GRID).mesh
    assert mesh.normals is not None
    program = lower(model)

    def paint(points: Doubles, _faces: Integers, _weights: Doubles) -> Doubles:
        return np.asarray(interpret.color(program, points.astype(np.float32)), np.float64)

    normals = mesh.normals.astype(np.float64)[mesh.faces]
    return Surface(mesh.vertices.astype(np.float64), mesh.faces, normals, paint if model.colored else None)


class Shelf:
    """A folder of models that stay for the next run."""

    def __init__(self, folder: Path) -> None:
        """folder: it exists."""
        self._folder = folder

    def model(self, name: str, make: Callable[[], Model]) -> Model:
        """Read a model, or make it and save it."""
        file = self._folder / f"{name}.safetensors"
        if not file.exists():
            save(make(), file)
        return load(file)


def of_gallery(names: Sequence[str]) -> Iterator[Named]:
    """Read models of the gallery."""
    for name in names:
        yield _named(name, name, load(gallery.model_path(name)))


def ours(shape: Shape, name: str, shelf: Shelf) -> Iterator[Named]:
    """Train a shape in all sizes. name: of the shape."""
    for size, levels in SIZES.items():
        networks, packed_weights = settings.networks(levels), PRESETS[size].packed
        omegas = settings.omegas(None, networks)
        chosen = Settings(networks, omegas, STEPS, texture=False, packed=packed_weights)
        key = f"{name}-{size}"
        yield _named(key, size, shelf.model(key, partial(_trained, shape, chosen)))


def _trained(shape: Shape, chosen: Settings) -> Model:
    """Train as `mplicits train` does."""
    suited = replace(chosen, omegas=suited_omegas(shape, chosen.networks))
    return Training(shape, suited, TrainingBar(quiet=True), components=loose_components).run()


def siren(shape: Shape, name: str, shelf: Shelf) -> Named:
    """Train one network by our trainer, in as many steps as a model of ours takes. name: of the shape."""

    def train() -> Model:
        chosen = Settings((SIREN,), (SIREN_OMEGA,), (sum(STEPS),), texture=False, weights={"excess": 1.0})
        return Training(shape, chosen, TrainingBar(quiet=True)).run()

    return _named(f"{name}-siren", "", shelf.model(f"{name}-siren", train))


def _named(key: str, size: str, model: Model) -> Named:
    """Describe a model by its size and levels."""
    levels = ",".join(size_text(level.network) for level in model.levels)
    return Named(key, f"{size} {levels}".strip(), model)


def files(method: str, named: Named, shelf: Shelf) -> Iterator[Result]:
    """Save a model as it is, and packed."""
    model = named.model
    small = shelf.model(f"{named.key}-packed", lambda: packed(model).model)
    for form, each in (("file", model), ("packed file", small)):
        yield Result(f"{method}, {form}", named.setting, len(to_bytes(each)), surface_of(each))


def texts(method: str, named: Named, shelf: Shelf) -> Iterator[Result]:
    """Bake a model as Shadertoy's text, as the tiny page and as the page."""
    model = named.model

    def coarse() -> Model:
        found = fewest_bits(model)
        assert found is not None
        return found

    if max(layer.weight.shape[0] for network in model.networks().values() for layer in network) <= shadertoy.WIDEST:
        rounded = shelf.model(f"{named.key}-text", coarse)
        surface = surface_of(rounded)
        chosen = shadertoy.emitted(model)
        text = shader_text(chosen.program, model, chosen.storage, chosen.further, None).encode()
        tiny = tiny_page.written(tiny_page.script_parts(chosen, model, None), model).text
        yield Result(f"{method}, Shadertoy text", named.setting, len(gzip.compress(text, 9, mtime=0)), surface)
        yield Result(f"{method}, tiny page", named.setting, len(tiny.encode()), surface)
    short = short_weights(model)
    page = TARGETS["html"](model)
    yield Result(f"{method}, page", named.setting, len(page.encode()), surface_of(short.model if short else model))
