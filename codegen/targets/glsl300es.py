"""Target glsl300es: the fragment shader alone, GLSL ES 3.00 (WebGL2)."""

from ... import glsl
from ...model.model import Model
from ..printers.cstyle import Language
from . import fragment
from .shader import Shader

DIALECT = fragment.Dialect(
    target="glsl300es",
    language=Language(sine="sine", cosine="cosine"),
    opening=("#version 300 es", "precision highp float;", "precision highp int;", "precision highp sampler2D;"),
    uniform="uniform {type} {name}; // {default}: {meaning}",
    advice="Set each uniform to the value that its comment begins with; draw a triangle over the image.",
    helpers="\n" + glsl.load("sine.glsl"),
)
"""GLSL ES has no initialisers of uniforms. Sines are computed by glsl/sine.glsl: the built-in ones are too coarse."""


def bake(model: Model, storage: str = "auto", digits: int | None = None, main: str = "main.glsl") -> Shader:
    """The fragment shader of `model`; see fragment.bake."""
    return fragment.bake(model, DIALECT, storage, digits, main)


def standalone(model: Model, storage: str = "auto", digits: int | None = None) -> str:
    """The shader as one file; a weight texture follows as comment lines in base64."""
    return fragment.with_weights(bake(model, storage, digits))
