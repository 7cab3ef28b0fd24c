"""The text of a shader that `bake --target glsl330` wrote -> what the renderer needs to know of it."""

from ...model.errors import UserError
from .glsl330 import DIALECT, read_weights
from .header import read_header
from .shader import Shader


def read_shader(text: str) -> tuple[Shader, str]:
    """Read a baked shader back: (shader, the model's name), all but the text from the header line.

    Raises UserError where the header line or the weights are missing or damaged, or the target is another.
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
    return shader, str(facts.get("name", "shader"))
