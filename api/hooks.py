"""Functions of other rooms that a training calls; cli.py and api/ pass them on, as rooms do not import one another."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..mesher.surface import Array
    from ..model.model import Model
    from ..trainer.sources import ModelSurface


def describe_surface(model: "Model", quiet: bool) -> str:
    """Describe the surface of a trained model in one line."""
    from ..mesher import surface_line

    return surface_line.describe_surface(model, quiet)


def loose_components(model: "Model") -> "Array":
    """Return the vertices (N, 3) of the loose components of a model's surface."""
    from ..mesher import surface_line

    return surface_line.loose_components(model)


def pictures(folder: Path) -> "Callable[[Model], None]":
    """Return a function that draws a model into `folder`, as a numbered PNG."""
    from .pictures import pictures

    return pictures(folder)


def surface_of(model: "Model", quiet: bool) -> "ModelSurface":
    """Extract the surface of a model that a training begins with: vertices, faces, and colors or None."""
    from ..mesher import surface_line

    mesh = surface_line.surface_of(model, quiet)
    return mesh.vertices, mesh.faces, mesh.colors


def pack(model: "Model", bits: str | float) -> "Model":
    """Round the weights of a trained model to few bits (--bits)."""
    from ..field.pack import packed
    from ..model.bits import read_bits

    return packed(model, read_bits(bits)).model
