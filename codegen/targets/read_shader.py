"""Reads the output of `mplicits bake --target glsl330`, to render it without the model file."""

from ...model.errors import UserError
from ...model.orientation import check_front
from .glsl330 import DIALECT, read_weights
from .header import read_header
from .shader import Shader


def read_shader(text: str) -> tuple[Shader, str, tuple[float, float] | None]:
    """Read a baked shader. Returns the shader, the model's name, and its front.

    The header line has the renderer's facts, and the end of the text has the weight texture. Raises UserError if either
    is missing or damaged, or if the text is of another target.
    """
    facts = read_header(text)
    if facts.get("target") != DIALECT.target:
        raise UserError(f"baked for another target than {DIALECT.target}; bake it with --target {DIALECT.target}")
    try:
        weights = read_weights(text)
        shader = Shader.of_facts(facts, text, weights)
    except (ValueError, IndexError):
        raise UserError("its header line or the weights at its end are damaged; bake it again") from None
    if weights is None and "uniform sampler2D weights" in text:
        raise UserError("the weights that belong at the shader's end are missing; bake it again")
    front = facts.get("front")
    if front is not None:
        check_front(front)
    return shader, str(facts.get("name", "shader")), None if front is None else (float(front[0]), float(front[1]))
