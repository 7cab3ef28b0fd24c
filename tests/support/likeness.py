"""The likeness of pictures, in dB."""

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from support.paths import ROOT

LEAST = 30
"""Least likeness of a page's picture to its reference, dB."""


def psnr(ours: NDArray[np.number], theirs: NDArray[np.number]) -> float:
    """Compare pictures with values from 0 to 255. Returns dB."""
    return float(10 * np.log10(255**2 / max(np.square(ours - theirs, dtype=float).mean(), 1e-9)))


def check_alike(ours: NDArray[np.int16], reference: NDArray[np.int16], name: str) -> None:
    """Fail the test where a picture (H, W, 3) is not like its reference, and write both to out/shipped/."""
    if (likeness := psnr(ours, reference)) >= LEAST:
        return
    folder = ROOT / "out" / "shipped"
    folder.mkdir(parents=True, exist_ok=True)
    for kind, picture in (("ours", ours), ("reference", reference)):
        Image.fromarray(picture.astype(np.uint8)).save(folder / f"{name}-{kind}.png")
    pytest.fail(f"{name}: {likeness:.1f} dB to its reference, at least {LEAST} are needed; see {folder}", pytrace=False)
