"""What a target returns beside its text."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Baked:
    """The text of a target."""

    text: str
    """The whole output file."""
    rounding: str | None = None
    """For people: how far the weights in the text are rounded; None for exact weights."""
    policy: str | None = None
    """The Content-Security-Policy of a page."""
