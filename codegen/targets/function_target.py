"""Shared by the targets that emit only the distance function: options, header, comments and the function's name."""

import re
from collections.abc import Callable

from ...ir.lower import lower
from ...ir.program import Program
from ...model.errors import UserError
from ...model.files import show
from ...model.model import MODEL_SPACE, SPACES, Model
from ..printers.cstyle import Language
from ..printers.field import STORAGES
from ..printers.shader_functions import ShaderFunctions
from ..printers.trace import TracingLanguage, print_trace
from ..printers.user_functions import FunctionLanguage, print_user_functions
from .header import header_facts, header_line
from .reserved_names import is_reserved

LONGEST_NAME = 40
"""Most characters of a function's name."""
WIDEST = 2 * STORAGES[0][0]
"""Widest network that drivers compile as literals within minutes."""

Standalone = Callable[[Model, str, int | None, str | None, str, bool], str]
"""A target's function: model, storage, digits, name, space, march -> text (see registry.py)."""


def shader_target(target: str, language: Language) -> Standalone:
    """Make the target of a language with vec4."""
    return function_target(target, lambda name: ShaderFunctions(language, name), WIDEST)


def function_target(target: str, language: Callable[[str], FunctionLanguage], widest: int | None = None) -> Standalone:
    """Make a target. language: from the function's name. widest: the widest network that it takes; None: any."""

    def standalone(
        model: Model,
        storage: str = "auto",
        digits: int | None = None,
        name: str | None = None,
        space: str = "model",
        march: bool = False,
    ) -> str:
        """Return the text. march: with NAME_trace. Raises UserError where an option or the model does not fit."""
        if storage not in ("auto", "literal"):
            raise UserError(f"--storage {storage}: {target} has its weights as constants; leave the option out")
        if space not in SPACES:
            raise UserError(f"--space {space}: there is {', '.join(SPACES)}")
        program = lower(model, digits, padded=False)
        broadest = max(map(program.widest, program.functions()))
        if widest is not None and broadest > widest:
            raise UserError(
                f"a network {broadest} wide is too large for constants in a shader, which take up to {widest}; "
                "bake it with --target c or python, or train narrower levels"
            )
        called = function_name(name, model.name, target)
        printed = language(called)
        facts = header_facts(model, program, target) | {"function": called, "space": space}
        lines = [header_line(facts, printed.comment)]
        lines += [f"{printed.comment} {line}" for line in _comments(program, called, space, march)]
        lines += printed.opening
        place = model.place if space == "input" else MODEL_SPACE
        lines += print_user_functions(program, printed, called, place, step=march)
        if march:
            assert isinstance(printed, TracingLanguage)
            lines += print_trace(program, printed, called, place)
        return "\n".join(lines) + "\n"

    return standalone


def function_name(name: str | None, model_name: str, target: str) -> str:
    """Return the function's name: `name`, or for None a name made from the model's.

    Raises UserError where `name` is no identifier, or where the target's language reserves it.
    """
    if name is None:
        made = re.sub("_+", "_", re.sub(r"[^a-z0-9]", "_", model_name.lower())).strip("_")[:LONGEST_NAME].strip("_")
        made = made if made[:1].isalpha() else f"sdf_{made}".strip("_")
        return f"{made}_sdf" if is_reserved(made, target) else made
    identifier = re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) is not None
    if not identifier or "__" in name or name.endswith("_") or len(name) > LONGEST_NAME:
        raise UserError(
            f"--name {show(name)}: a name is a letter, then letters, digits and single _ between them, "
            f"{LONGEST_NAME} characters at most"
        )
    if is_reserved(name, target):
        raise UserError(f"--name {name}: {target} reserves this name; choose another")
    return name


def _comments(program: Program, name: str, space: str, march: bool) -> list[str]:
    """Return the comment lines that tell a reader how to use the functions."""
    time = ", time" if program.moving else ""
    unit = "the shape fits the unit sphere, y is up" if space == "model" else "as in the shape's file"
    lines = [
        f"A neural signed distance function of {len(program.bands)} nested level{'s' * (len(program.bands) > 1)}.",
        f"Points and distances: {unit}.",
        f"{name}(p{time}): signed distance, negative inside. {name}_level(p, level{time}): levels 1 to `level`.",
        f"{name}_normal(p{time}): its gradient, of length 1. {name}_color(p{time}): color on the surface, sRGB.",
    ]
    if march:
        lines += [
            f"{name}_trace(origin, direction{time}, t, normal): whether origin + t direction meets the surface.",
            f"{name}_step(p{time}): how far a ray may go from p.",
        ]
    return lines
