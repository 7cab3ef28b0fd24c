"""The expected picture of an engine, from the numpy reference, and the texts of docs/engines.md."""

import math
import re
from textwrap import dedent

import numpy as np
from numpy.typing import NDArray

import mplicits
from support.paths import ROOT

SIDE = 96
"""Side of a picture, pixels."""
DISTANCE, FOV = 3.5, 40.0
"""The camera: on the z axis, looking at the origin; vertical field of view, degrees."""


def documented(heading: str) -> str:
    """Return the indented text under a heading of docs/engines.md."""
    page = (ROOT / "docs" / "engines.md").read_text(encoding="utf-8")
    section = re.split(r"^## ", page, flags=re.MULTILINE)
    (text,) = (part for part in section if part.partition("\n")[0] == heading)
    lines = [line for line in text.splitlines() if line.startswith("    ")]
    return dedent("\n".join(lines)) + "\n"


def assert_shows(picture: NDArray[np.uint8], field: mplicits.Field) -> None:
    """Assert that a picture, (SIDE, SIDE, 3), shows the reference's surface and colors.

    Its first pixel is background. An engine's march stops short of the silhouette, or steps over a thin place: 1 in 100
    pixels may differ.
    """
    center = (np.arange(SIDE) + 0.5) * 2 / SIDE - 1
    x, y = np.meshgrid(center, -center)
    directions = np.stack([x, y, np.full_like(x, -1 / math.tan(math.radians(FOV / 2)))], axis=-1)
    hits = field.trace([0, 0, DISTANCE], directions)
    shown = (np.abs(picture.astype(int) - picture[0, 0]) > 3).any(axis=-1)
    assert 0.1 < hits.hit.mean() < 0.9
    assert (shown != hits.hit).mean() < 0.01
    both = shown & hits.hit
    wrong = np.abs(picture[both] / 255 - field.color(hits.points[both])).max(axis=-1)
    assert np.median(wrong) < 0.02
    assert np.quantile(wrong, 0.9) < 0.1
