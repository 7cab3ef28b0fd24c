"""What a person wants to know of a model's surface as soon as the model is trained."""

from dataclasses import replace

from ..model.errors import UserError
from ..model.model import Model
from .bar import Bar
from .extract import extract_model

RESOLUTION = 256
"""Of the grid on which the surface is extracted. Smaller pieces than a cell, 1/128, may be missed."""


def describe_surface(model: Model, quiet: bool) -> str:
    """Describe the surface of a model's last level in one line: how many connected components it has.

    quiet: show no progress bar. A model without a surface is described as one.
    """
    bar = Bar(quiet)
    try:
        extracted = extract_model(replace(model, texture=None), RESOLUTION, bar)
    except UserError as error:
        return f"surface: {error}"
    finally:
        bar.end()
    lost = f", and {extracted.spurious} outside the bands, which are not drawn" if extracted.spurious else ""
    return (
        f"surface: {extracted.components} closed component{'s' * (extracted.components != 1)} "
        f"(marching cubes at {RESOLUTION}^3){lost}"
    )
