"""What `--levels auto` is to reach, and how many parameters its levels have; nothing here needs torch."""

from ..model.errors import UserError
from .settings import Wish, usual_texture

NARROWEST, WIDEST = 8, 512
"""Widths that are chosen from, in steps of 4: shaders read weights four at a time."""
BYTES = 4
"""Of a parameter in the model file."""
HEADER = 2500
"""Bytes of a model file beside its parameters, nearly."""


def wish_of(parameters: int | None, kilobytes: float | None, error: float | None, *, automatic: bool) -> Wish | None:
    """Make the wish of the options --parameters, --kilobytes and --error; None where the user gives the levels.

    kilobytes: of the model file, each of 1000 bytes. automatic: whether the levels are to be chosen; exactly one of the
    three is needed then. Raises UserError.
    """
    options = {"--parameters": parameters, "--kilobytes": kilobytes, "--error": error}
    given = [name for name, value in options.items() if value is not None]
    if not automatic:
        if given:
            raise UserError(f"{given[0]}: for --levels auto, which chooses the levels by it")
        return None
    if len(given) != 1:
        said = " and ".join(given) or "none"
        raise UserError(f"--levels auto: one of {', '.join(options)} is needed; there is {said}")
    if kilobytes is not None:
        parameters = int((1000 * kilobytes - HEADER) / BYTES)
    least, most = size(NARROWEST, textured=False), size(WIDEST, textured=True)
    if parameters is not None and not least <= parameters <= most:
        raise UserError(f"{given[0]}: {parameters:,} parameters; from {least:,} to {most:,} are possible")
    if error is not None and not 1e-6 <= error <= 0.1:
        raise UserError(f"--error {error:g}: a length from 1e-6 to 0.1, in radii of the shape")
    return Wish(parameters, error)


def size(width: int, *, textured: bool) -> int:
    """Count the parameters of levels of Wx1 and Wx2, with the texture that they get by default."""
    texture = _network_size(*usual_texture((width, 2)), 3) if textured else 0
    return _network_size(width, 1, 1) + _network_size(width, 2, 1) + texture


def _network_size(width: int, depth: int, outputs: int) -> int:
    return width * 4 + depth * width * (width + 1) + outputs * (width + 1)
