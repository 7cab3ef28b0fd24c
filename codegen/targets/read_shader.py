"""The text of a shader that `bake --target glsl330` wrote -> what the renderer needs to know of it."""

import json
import re

from ...model.errors import UserError
from .glsl330 import read_weights
from .shader import Shader

_FUNCTION = re.compile(r"^(?:float|vec\d) (\w+)\([^)]*\) \{$(.*?)^\}$", re.MULTILINE | re.DOTALL)
_LOOP = re.compile(r"for \(int (\w+) = 0; \1 < (\d+); (?:\+\+\1|\1 \+= (\d+))\)")
_NAME = re.compile(r'^// Multiscale neural signed distance function (".*"), levels', re.MULTILINE)


def read_shader(text: str) -> tuple[Shader, str]:
    """(shader, the model's name). Raises UserError where a part that the renderer counts on is not there."""
    levels = re.search(r"^const int LEVELS = (\d+);", text, re.MULTILINE)
    iterations, deltas = (_array(text, name) for name in ("int iterations", "float delta"))
    if levels is None or not len(iterations) == len(deltas) == int(levels[1]) > 0:
        raise UserError("no LEVELS, iterations[LEVELS] and delta[LEVELS] as bake --target glsl330 writes them")
    functions = dict(_FUNCTION.findall(text))
    if "field" not in functions or "field_gradient" not in functions:
        raise UserError("no field() and field_gradient() as bake --target glsl330 writes them")
    try:
        weights, steps, widths = read_weights(text), tuple(map(int, iterations)), tuple(map(float, deltas))
    except (ValueError, IndexError):
        raise UserError("iterations, deltas or the weights at the shader's end are damaged; bake it anew") from None
    if weights is None and "uniform sampler2D weights" in text:
        raise UserError("the weights that belong at the shader's end are missing; bake it anew")
    return Shader(
        text=text,
        weights=weights,
        value_loops=_loops(functions, "field", len(deltas)),
        gradient_loops=_loops(functions, "field_gradient", len(deltas)),
        texture_loops=sum(_iterations(functions[call]) for call in _calls(functions, "albedo")),
        iterations=steps,
        deltas=widths,
    ), _name(text)


def _name(text: str) -> str:
    found = _NAME.search(text)
    try:
        return str(json.loads(found[1])) if found else "shader"
    except ValueError:
        return "shader"


def _array(text: str, name: str) -> list[str]:
    found = re.search(rf"^uniform {name}\[LEVELS\] = \w+\[\]\(([-+.\de, ]+)\);", text, re.MULTILINE)
    return found[1].split(",") if found else []


def _loops(functions: dict[str, str], name: str, levels: int) -> tuple[int, ...]:
    """As `Shader.value_loops`: the functions that `name` calls are those of the levels, in order."""
    each = [_iterations(functions[call]) for call in _calls(functions, name)]
    return tuple(sum(each[:level]) for level in range(1, levels + 1))


def _calls(functions: dict[str, str], name: str) -> list[str]:
    body = functions.get(name, "")
    return [call for call in re.findall(r"(\w+)\(", body) if call in functions and call != name]


def _iterations(body: str) -> int:
    """Loop iterations of a function's body, an inner loop once more for each of the outer's (see Texture.loops)."""
    total, outer, depth = 0, 1, 0
    for line in body.splitlines():
        if loop := _LOOP.search(line):
            count = int(loop[2]) // int(loop[3] or 1)
            if depth == 0:
                total, outer = total + count + 1, count
            else:
                total += outer * (count + 1)
            depth += 1
        elif line.strip() == "}":
            depth -= 1
    return total
