"""Text of a target: the work of `bake`, without its files and messages."""

from dataclasses import dataclass

from ..field.rounding import in_float16, rounding_error, rounding_line
from ..model.model import Model
from .options import BakeOptions
from .registry import TARGETS


@dataclass(frozen=True)
class Baked:
    """The text of a target, and the error of its rounded weights."""

    text: str
    """The whole output file."""
    rounding: tuple[str, ...]
    """Lines for people: how far each rounding of the weights moves the surface. Empty for exact weights."""


def bake(model: Model, options: BakeOptions) -> Baked:
    """Write a model as the text of a target. Raises UserError where the target does not take the model or an option."""
    lines, exact, target = [], model, TARGETS[options.target]
    if options.precision == "float16":
        model = in_float16(exact)
        lines.append(rounding_line(options.precision, rounding_error(exact, model)))
    text = target(
        model,
        storage=options.storage,
        digits=options.digits,
        name=options.name,
        space=options.space,
        shade=options.shade,
        studio=options.studio,
        with_march=options.with_march,
    )
    if line := target.rounding(model, options.storage, options.digits, options.studio):
        lines.append(line)
    return Baked(text, tuple(lines))
