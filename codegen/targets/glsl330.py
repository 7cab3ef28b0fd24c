"""Target glsl330: a complete fragment shader in GLSL 3.30, for desktop OpenGL 3.3 core."""

import base64

import numpy as np

from ...ir.program import Array
from ...model.model import Model
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


def bake(
    model: Model,
    storage: str = "auto",
    digits: int | None = None,
    main: str = "main.glsl",
    passes: bool = False,
    traces: bool = True,
) -> Shader:
    return fragment.bake(model, DIALECT, storage, digits, main, passes, traces)


def standalone(model: Model, storage: str = "auto", digits: int | None = None) -> str:
    return fragment.with_weights(bake(model, storage, digits))


def read_weights(text: str) -> Array | None:
    """Read the weight texture, (H, W, 4) float32, from the comment lines at a shader's end.

    Returns None where there is none. Raises ValueError or IndexError where it is damaged.
    """
    _, mark, data = text.rpartition("\n// weights: ")
    if not mark:
        return None
    size, *lines = data.splitlines()
    width, height = int(size.split()[0]), int(size.split()[2])
    values = np.frombuffer(base64.b64decode("".join(line.removeprefix("// ") for line in lines)), "<f4")
    return values.reshape(height, width, 4).astype(np.float32)
