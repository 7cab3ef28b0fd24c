"""A training joined with other rooms, for the command line and for Python: rooms do not import one another."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..trainer.options import MorphOptions, TrainingOptions, TrainOptions

if TYPE_CHECKING:
    from ..model.model import Model
    from ..trainer.session import Finished, Request
    from ..trainer.shapes.arrays import Arrays
    from ..trainer.sources import ModelSurface, Source


def source_of_shape(shape: "str | Path | Arrays", options: TrainOptions) -> "Source":
    """Return the source of `train`: a shape, or with `time` a folder of meshes. Raises UserError."""
    from ..trainer.sources import frames_source, shape_source

    return frames_source(shape, options) if options.time else shape_source(shape, options)


def source_of_morph(first: "str | Path | Model", second: "str | Path | Model", options: MorphOptions) -> "Source":
    """Return the source of `morph`, which finds the surfaces of models by the mesher. Raises UserError."""
    from ..mesher import surface_line
    from ..trainer.sources import morph_source

    def surface_of(model: "Model") -> "ModelSurface":
        mesh = surface_line.surface_of(model, options.quiet)
        return mesh.vertices, mesh.faces, mesh.colors

    return morph_source(first, second, surface_of, options)


def finished(source: "Source", options: TrainingOptions, request: "Request") -> "Finished":
    """Train with the mesher's search for loose components, and the rounding of --bits. Raises UserError."""
    from ..mesher import surface_line
    from ..trainer.session import make_model

    bits = options.bits if isinstance(options, TrainOptions) else None
    rounded = None if bits is None else partial(_rounded, bits=bits)
    return make_model(source, options, request, surface_line.loose_components, rounded)


def _rounded(model: "Model", bits: str | float) -> "Model":
    """Round the weights to few bits."""
    from ..field.pack import packed
    from ..model.bits import read_bits

    return packed(model, read_bits(bits)).model
