"""Reads back what `mplicits bake --target glsl330` wrote, so that it can be rendered without the model file."""

from ...model.errors import UserError
from ...model.orientation import check_front
from .glsl330 import DIALECT, read_weights
from .header import read_header
from .shader import Shader


def read_shader(text: str) -> tuple[Shader, str, tuple[float, float] | None]:
    """Read a baked shader from its text. Returns the shader, the model's name, and its front.

    What the renderer needs to know beside the text stands in its header line, and the weight texture at its end. Raises
    UserError where the header line or the weights are missing or damaged, or the text was baked for another target.
    """
    facts = read_header(text)
    if facts.get("target") != DIALECT.target:
        raise UserError(f"baked for another target than {DIALECT.target}; bake it with --target {DIALECT.target}")
    try:
        weights = read_weights(text)
        shader = Shader.of_facts(facts, text, weights)
    except (ValueError, IndexError):
        raise UserError("its header line or the weights at its end are damaged; bake it anew") from None
    if weights is None and "uniform sampler2D weights" in text:
        raise UserError("the weights that belong at the shader's end are missing; bake it anew")
    front = facts.get("front")
    if front is not None:
        check_front(front)
    return shader, str(facts.get("name", "shader")), None if front is None else (float(front[0]), float(front[1]))
