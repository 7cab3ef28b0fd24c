"""What the targets share that are functions alone: the name, the space, the header, and how each is used."""

from ... import glsl
from ...ir.lower import lower
from ...ir.program import Program
from ...model.errors import UserError
from ...model.model import MODEL_SPACE, Model
from ..printers.cstyle import Language
from ..printers.field import STORAGES
from ..printers.user_functions import Place, function_name, print_function
from .header import header_facts, header_line

SPACES = ("model", "input")
"""Where a function takes points: where the shape fits the unit sphere, or where the shape's file has it."""


def prepared(
    model: Model, storage: str, digits: int | None, name: str | None, space: str, widest: int | None = None
) -> tuple[Program, str, Place]:
    """Return a model's program, its function's name and the place of its space.

    widest: the widest network that the language takes as literals; None: any. Raises UserError where an option, or the
    model, does not fit.
    """
    if storage not in ("auto", "literal"):
        raise UserError(f"--storage {storage}: a function alone has its weights as constants; leave the option out")
    if space not in SPACES:
        raise UserError(f"--space {space}: there is {', '.join(SPACES)}")
    program = lower(model, digits, padded=False)
    broadest = max(map(program.widest, program.functions()))
    if widest is not None and broadest > widest:
        raise UserError(
            f"a network {broadest} wide is too large for constants in a shader, which take up to {widest}; "
            "bake it with --target c or python, or train narrower levels"
        )
    return program, function_name(name, model.name), model.place if space == "input" else MODEL_SPACE


def in_shader(
    model: Model,
    target: str,
    language: Language,
    storage: str,
    digits: int | None,
    name: str | None,
    space: str,
) -> str:
    """Return the text of a function alone in a language of shaders."""
    program, called, place = prepared(model, storage, digits, name, space, WIDEST)
    facts = header_facts(model, program, target) | {"function": called, "space": space}
    lines = [header_line(facts), *(f"// {line}" for line in described(program, called, space))]
    return "\n".join(lines) + "\n" + print_function(program, language, called, place, glsl.load("sine.glsl"))


def described(program: Program, name: str, space: str) -> list[str]:
    """Return the lines that tell a reader what there is."""
    time = ", time" if program.moving else ""
    unit = "the shape fits the unit sphere, y is up" if space == "model" else "as in the shape's file"
    return [
        f"A neural signed distance function of {len(program.bands)} nested level{'s' * (len(program.bands) > 1)}.",
        f"Points and distances: {unit}.",
        f"{name}(p{time}): signed distance, negative inside. {name}_level(p, level{time}): levels 1 to that one alone.",
        f"{name}_normal(p{time}): its gradient, of length 1. {name}_color(p{time}): colour on the surface, sRGB.",
    ]


WIDEST = 2 * STORAGES[0][0]
"""Widest network that drivers compile as literals within minutes."""
