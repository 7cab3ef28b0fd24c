"""Text of a target: the work of `bake`, without its files and messages."""

from ..codegen.targets.baked import Baked
from ..field.rounding import in_float16, rounding_error, rounding_line
from ..model.model import Model
from .options import BakeOptions
from .registry import TARGETS


def bake(model: Model, options: BakeOptions) -> tuple[Baked, list[str]]:
    """Write a model as the text of a target, with a line for people about each rounding of its weights.

    Raises UserError where the target does not take the model or an option.
    """
    lines, exact = [], model
    if options.precision == "float16":
        model = in_float16(exact)
        lines.append(rounding_line(options.precision, rounding_error(exact, model)))
    baked = TARGETS[options.target].baked(
        model,
        storage=options.storage,
        digits=options.digits,
        name=options.name,
        space=options.space,
        shade=options.shade,
        studio=options.studio,
        with_march=options.with_march,
    )
    return baked, [*lines, *([baked.rounding] if baked.rounding else [])]
