"""Reads point clouds of text columns."""

from collections.abc import Sequence
from pathlib import Path

from .clouds import cloud_of_columns, cloud_of_table
from .content import Cloud
from .text_table import read_table

PTS = ("x", "y", "z", "-", "r", "g", "b")
"""Columns of a PTS file, whose fourth is the intensity."""


def read_text(path: Path, chosen: Sequence[str] | None = None) -> Cloud:
    """Read text columns, by `chosen`, by a header, or by their lengths and ranges. Raises UserError."""
    table = read_table(path)
    if table.names is None and chosen is None and path.suffix.lower() == ".pts" and table.rows.shape[1] == 7:
        chosen = PTS
    if table.names is None or chosen is not None:
        return cloud_of_table(table.rows, chosen)
    return cloud_of_columns(table.names, list(table.rows.T), typed=False)
