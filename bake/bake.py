"""A model as the text of a target: what the verb `bake` does, without its files and its lines of text."""

from dataclasses import dataclass

from ..field.rounding import in_float16, rounding_error
from ..model.errors import UserError
from ..model.files import show
from ..model.model import Model
from .registry import DEFAULT, TARGETS

PRECISIONS = ("float32", "float16")
"""What the weights may be rounded to, beside decimals."""


@dataclass(frozen=True)
class Baked:
    """The text of a target, and what it cost."""

    text: str
    """The whole output file."""
    rounding: tuple[float, float] | None
    """Largest and mean difference of the distance near the surface where weights are float16, model units."""


def bake(
    model: Model,
    target: str = DEFAULT,
    storage: str = "auto",
    digits: int | None = None,
    precision: str = "float32",
    name: str | None = None,
    space: str | None = None,
    shade: str | None = None,
) -> Baked:
    """Write a model as the text of a target.

    The arguments are the options of `mplicits bake` (docs/targets.md), with their names and defaults. Raises UserError
    where there is no such target, or where it does not take the model or an option.
    """
    if target not in TARGETS:
        raise UserError(f"--target {show(target)}: there is {', '.join(TARGETS)}")
    if precision not in PRECISIONS:
        raise UserError(f"--precision {show(precision)}: there is {', '.join(PRECISIONS)}")
    if precision == "float16" and digits is not None:
        raise UserError("--precision: not allowed with --digits: weights are rounded once")
    rounding = None
    if precision == "float16":
        exact, model = model, in_float16(model)
        rounding = rounding_error(exact, model)
    text = TARGETS[target](model, storage=storage, digits=digits, name=name, space=space, shade=shade)
    return Baked(text, rounding)
