"""Target glsl300es: a complete fragment shader in GLSL ES 3.00, for WebGL2."""

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
"""GLSL ES has no initializers of uniforms, so comments state their defaults.

glsl/functions/sine.glsl computes the sines, since the built-in ones are too coarse on some devices.
"""


def bake(model: Model, storage: str = "auto", digits: int | None = None, main: str = "main.glsl") -> Shader:
    return fragment.bake(model, DIALECT, storage, digits, main)


def standalone(model: Model, storage: str = "auto", digits: int | None = None) -> str:
    return fragment.with_weights(bake(model, storage, digits))
