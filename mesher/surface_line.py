"""The line about a trained model's surface: components, holes, specks."""

from dataclasses import replace

import numpy as np

from ..model.errors import UserError
from ..model.model import Model
from .extract import extract, extract_model
from .grid import Grid
from .model_field import ModelField
from .progress import Bar
from .surface import Array, Mesh

RESOLUTION = 256
"""Resolution of the grid that extracts the surface. It may miss components smaller than a cell, 1/128."""
FINE_RESOLUTION = 512
"""Resolution of the grid that finds loose components."""
SMALL = 0.1
"""Largest diagonal of a small component, model units: a larger one is as likely to be the shape's own."""
TIMES = (0.0, 0.5, 1.0)
"""Times at which the surface of a moving model is surveyed."""
MOVING_RESOLUTION = 128
"""Resolution for a moving model, whose surface is extracted at several times."""
MOMENT_RESOLUTION = 320
"""Resolution for a model that a motion begins or ends with."""


def surface_of(model: Model, quiet: bool) -> Mesh:
    """Extract the surface of a model's last level, with its colors, in model space. quiet: show no progress bar.

    Raises UserError where the model has none.
    """
    bar = Bar(quiet)
    try:
        return extract_model(model, MOMENT_RESOLUTION, bar).mesh
    finally:
        bar.end()


def loose_components(model: Model) -> Array:
    """Return the vertices (N, 3) of the small components beside the largest one, model space.

    Components outside the bands, which are not drawn (Fig. 8), are left out.
    """
    field = ModelField(model, Grid(FINE_RESOLUTION).diagonal)
    mesh = extract(field, FINE_RESOLUTION)
    if not len(mesh.faces):
        return mesh.vertices
    count, component = mesh.components()
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, component, mesh.vertices)
    np.maximum.at(high, component, mesh.vertices)
    size = np.linalg.norm(high - low, axis=1)
    small = size < SMALL
    small[size.argmax()] = False
    suspects = np.flatnonzero(small[component])
    drawn = np.unique(component[suspects[field.in_bands(mesh.vertices[suspects])]])
    return mesh.vertices[np.isin(component, drawn)]


def describe_surface(model: Model, quiet: bool) -> str:
    """Describe the surface of a model's last level in one line: how many connected components it has.

    quiet: show no progress bar. A moving model is surveyed at `TIMES`.
    """
    if model.inputs == "xyzt":
        lines = (_describe(model, quiet, MOVING_RESOLUTION, time).removeprefix("surface: ") for time in TIMES)
        return "\n".join(f"at t = {time:g}: {line}" for time, line in zip(TIMES, lines, strict=True))
    return _describe(model, quiet, RESOLUTION, 0.0)


def _describe(model: Model, quiet: bool, resolution: int, time: float) -> str:
    bar = Bar(quiet)
    try:
        extracted = extract_model(replace(model, texture=None), resolution, bar, time=time)
    except UserError as error:
        return f"surface: {error}"
    finally:
        bar.end()
    lost = f", and {extracted.spurious} outside the bands, which are not drawn" if extracted.spurious else ""
    return (
        f"surface: {extracted.components} closed component{'s' * (extracted.components != 1)} "
        f"(marching cubes at {resolution}^3){lost}"
    )
