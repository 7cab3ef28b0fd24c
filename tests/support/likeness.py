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


def check_alike(ours: NDArray[np.int16], name: str, *references: NDArray[np.int16], least: float = LEAST) -> None:
    """Fail the test where a picture (H, W, 3) is like none of its references, and write it and the nearest.

    Several references differ in the samples of a pixel, which a page chooses by its speed. name: of the files, in
    out/shipped/.
    """
    likeness, reference = max(((psnr(ours, each), each) for each in references), key=lambda pair: pair[0])
    if likeness >= least:
        return
    folder = ROOT / "out" / "shipped"
    folder.mkdir(parents=True, exist_ok=True)
    for kind, picture in (("ours", ours), ("reference", reference)):
        Image.fromarray(picture.astype(np.uint8)).save(folder / f"{name}-{kind}.png")
    pytest.fail(f"{name}: {likeness:.1f} dB to its reference, at least {least} are needed; see {folder}", pytrace=False)
