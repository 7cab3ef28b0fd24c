"""The option --bits of `pack` and `train`."""

from .errors import UserError
from .files import show

AUTOMATIC = "auto"
"""Value of --bits that asks for the fewest bits within limits."""
LEAST, MOST = 2, 16
"""Bits for each weight."""


def read_bits(bits: str | float) -> float | None:
    """Return the bits for each weight; None: the fewest within limits. Raises UserError."""
    if bits == AUTOMATIC:
        return None
    try:
        number = float(bits)
    except ValueError:
        number = 0.0
    if not LEAST <= number <= MOST:
        raise UserError(f"--bits {show(str(bits))}: {AUTOMATIC}, or a number from {LEAST} to {MOST} is needed")
    return number
