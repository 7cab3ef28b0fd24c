"""The targets of `mplicits bake`: a new one is one file and one line here."""

from typing import Protocol

from ...model.model import Model
from . import cuda, glsl300es, glsl330, shadertoy, webpage


class Target(Protocol):
    """Model -> the text of the whole output file."""

    def __call__(self, model: Model, storage: str = "auto", digits: int | None = None) -> str:
        """storage: how weights are stored; digits: decimals of the weights, None for all."""


TARGETS: dict[str, Target] = {
    "glsl330": glsl330.standalone,
    "glsl300es": glsl300es.standalone,
    "html": webpage.standalone,
    "shadertoy": shadertoy.standalone,
    "cuda": cuda.standalone,
}
"""Name -> target."""

SUFFIXES = {"glsl330": ".glsl", "glsl300es": ".es.frag", "html": ".html", "shadertoy": ".frag", "cuda": ".cu"}
"""How the output file's name ends where the user gives none."""
