"""Text of a target: the work of `bake`, without its files and messages."""

from dataclasses import dataclass

from ..field.rounding import in_float16, rounding_error
from ..model.model import Model
from ..web.short_weights import coded_weights, short_weights
from .options import BakeOptions
from .registry import TARGETS


@dataclass(frozen=True)
class Baked:
    """The text of a target, and the error of its rounded weights."""

    text: str
    """The whole output file."""
    rounding: tuple[float, float] | None
    """Largest and mean difference of the distance near the surface, model units, where weights have few bits."""
    kind: str
    """What these weights are, for people."""


def bake(model: Model, options: BakeOptions) -> Baked:
    """Write a model as the text of a target. Raises UserError where the target does not take the model or an option."""
    rounding, kind = None, options.precision
    if options.precision == "float16":
        exact, model = model, in_float16(model)
        rounding = rounding_error(exact, model)
    elif TARGETS[options.target].page:
        short = (coded_weights if options.target == "module" else short_weights)(model)
        if short is not None:
            rounding, kind = short.error, short.kind
    text = TARGETS[options.target](
        model,
        storage=options.storage,
        digits=options.digits,
        name=options.name,
        space=options.space,
        shade=options.shade,
        studio=options.studio,
        with_march=options.with_march,
    )
    return Baked(text, rounding, kind)
