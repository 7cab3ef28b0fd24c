"""The goal of `--levels auto`, and the number of parameters of its levels. Nothing here needs torch."""

from ..model.errors import UserError
from .settings import LevelGoal, default_texture

NARROWEST, WIDEST = 8, 512
"""Limits of the chosen width, which is a multiple of 4: shaders read four weights at a time."""
BYTES = 4
"""Bytes of a parameter in the model file."""
HEADER = 3300
"""Approximate bytes of a model file without its parameters."""


def level_goal(
    parameters: int | None, kilobytes: float | None, error: float | None, *, automatic: bool
) -> LevelGoal | None:
    """Return the goal of the options --parameters, --kilobytes and --error; None where the user gives the levels.

    kilobytes: largest model file, in units of 1000 bytes. automatic: whether --levels is "auto", which needs exactly
    one of the three options. Raises UserError.
    """
    options = {"--parameters": parameters, "--kilobytes": kilobytes, "--error": error}
    named = [name for name, value in options.items() if value is not None]
    if not automatic:
        if named:
            raise UserError(f"{named[0]}: needs --levels auto, which chooses the levels by it")
        return None
    if len(named) != 1:
        raise UserError(f"--levels auto: needs one of {', '.join(options)}; there is {' and '.join(named) or 'none'}")
    if kilobytes is not None:
        parameters = int((1000 * kilobytes - HEADER) / BYTES)
    least, most = parameters_of_width(NARROWEST, textured=False), parameters_of_width(WIDEST, textured=True)
    if parameters is not None and not least <= parameters <= most:
        raise UserError(f"{named[0]}: {parameters:,} parameters; from {least:,} to {most:,} are possible")
    if error is not None and not 1e-6 <= error <= 0.1:
        raise UserError(f"--error {error:g}: a length from 1e-6 to 0.1, in radii of the shape")
    return LevelGoal(parameters, error)


def parameters_of_width(width: int, *, textured: bool) -> int:
    """Count the parameters of the levels Wx1 and Wx2, and of their default texture."""
    texture = _network_size(*default_texture((width, 2)), 3) if textured else 0
    return _network_size(width, 1, 1) + _network_size(width, 2, 1) + texture


def _network_size(width: int, depth: int, outputs: int) -> int:
    return width * 4 + depth * width * (width + 1) + outputs * (width + 1)
