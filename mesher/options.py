"""Options of `mesh` and `eval`."""

from dataclasses import dataclass

from ..model.options import Options, option
from ..model.references import follow_option

RESOLUTION = 512
"""Default number of cells along each side of the grid, as in the paper."""
LEAST, MOST = 8, 4096
"""Bounds of the resolution."""
TIME = "time of a model that moves, from 0 to 1 (default: 0)"


@dataclass(frozen=True)
class MeshOptions(Options):
    """Options of `mesh`, for the command line and for Python (docs/meshing.md)."""

    resolution: int = option(
        RESOLUTION, "cells along each side of the grid over [-1, 1]^3", metavar="N", least=LEAST, most=MOST
    )
    level: int | None = option(None, "level whose surface is extracted (default: the last)", metavar="L")
    no_cull: bool = option(
        False, "evaluate the last level at every vertex of the grid, and keep components outside the bands", study=True
    )
    keep_specks: bool = option(
        False, "keep components of fewer than 100 triangles within a cell of the surface (default: remove them)"
    )
    space: str = option(
        "input",
        "coordinates of the vertices: those of the shape's file, or of the unit sphere",
        choices=("input", "model"),
    )
    quiet: bool = option(False, "show no progress bar")
    time: float | None = option(None, TIME, metavar="T", least=0, most=1)


@dataclass(frozen=True)
class EvalOptions(Options):
    """Options of `eval`, for the command line and for Python."""

    resolution: int | None = option(
        None,
        f"cells along each side of the grid over [-1, 1]^3 (default: {RESOLUTION})",
        metavar="N",
        least=LEAST,
        most=MOST,
    )
    level: int | None = option(None, "level that is evaluated (default: the last)", metavar="L")
    samples: int = option(
        500_000, "points sampled on each surface", metavar="N", least=100, most=100_000_000, study=True
    )
    seed: int = option(0, "seed of the samples", metavar="K", least=0, study=True)
    quiet: bool = option(False, "show no progress bar")
    time: float | None = option(None, TIME, metavar="T", least=0, most=1)
    follow: bool = follow_option()
