"""Checkpoints of the paper's authors become a model: what the verb `import` does, without its files and its text."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..model.model import Model
from .checkpoint import to_model
from .options import Numbers, file_omegas, text_of
from .settings import front as front_of


def import_checkpoints(
    checkpoints: Sequence[Path],
    omega: Numbers | None = None,
    shape: str | None = None,
    front: Numbers | None = None,
    credit: str | None = None,
) -> Model:
    """Make a model of checkpoints of the authors' own release, coarse to fine.

    The arguments are the options of `mplicits import` (docs/training.md), with their names and defaults. Raises
    UserError.
    """
    omegas, view = file_omegas(omega, len(checkpoints)), front_of(text_of(front))
    return replace(to_model(checkpoints, omegas, shape), front=view, credit=credit or "")
