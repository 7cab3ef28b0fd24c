"""Target glsl330: a complete desktop fragment shader, GL 3.3 core."""

import base64

import numpy as np

from ...model.model import Model
from ..ir.program import Array
from ..printers.cstyle import Language
from . import fragment
from .shader import Shader

DIALECT = fragment.Dialect(
    target="glsl330",
    language=Language(),
    opening=("#version 330 core",),
    uniform="uniform {type} {name} = {default}; // {meaning}",
    advice="Every uniform has a default; draw a triangle over the image.",
)


def bake(model: Model, storage: str = "auto", digits: int | None = None, main: str = "main.glsl") -> Shader:
    """The fragment shader of `model`; see fragment.bake."""
    return fragment.bake(model, DIALECT, storage, digits, main)


def standalone(model: Model, storage: str = "auto", digits: int | None = None) -> str:
    """The shader as one file; a weight texture follows as comment lines in base64."""
    return fragment.with_weights(bake(model, storage, digits))


def read_weights(text: str) -> Array | None:
    """The weight texture (H, W, 4) that `standalone` appended to a shader, or None."""
    _, found, data = text.rpartition("\n// weights: ")
    if not found:
        return None
    size, *lines = data.splitlines()
    width, height = int(size.split()[0]), int(size.split()[2])
    values = np.frombuffer(base64.b64decode("".join(line.removeprefix("// ") for line in lines)), "<f4")
    return values.reshape(height, width, 4).astype(np.float32)
