"""Whole pictures of a scene that is learnt, and how far they are from photographs that it never saw."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from .bundle import rays_of
from .posed import Posed
from .rendering import Effort, Scene, render

CHUNK = 2048
"""Rays that are rendered at a time."""


@dataclass(frozen=True, eq=False)
class Pictured:
    """A view as a scene shows it."""

    colours: NDArray[np.float32]
    """(H, W, 3), sRGB, not clamped; with what is behind the object."""
    psnr: float
    """In decibels, over the mask's pixels, or, without a mask, over all."""


@torch.no_grad()
def picture(scene: Scene, view: Posed, effort: Effort, background: float, device: torch.device) -> Pictured:
    """Render a view. background: grey where nothing is, sRGB."""
    rays, index = rays_of([view], device)
    width, height = view.size
    colours = np.full((height * width, 3), background, np.float32)
    for k in range(0, len(rays), CHUNK):
        rendered = render(scene, rays.take(slice(k, k + CHUNK)), effort)
        behind = background * (1 - rendered.opacity[:, None])
        colours[index[k : k + CHUNK].cpu().numpy()] = (rendered.colours + behind).cpu().numpy()
    shown = colours.reshape(height, width, 3)
    return Pictured(shown, psnr(shown, view))


def psnr(colours: NDArray[np.float32], view: Posed) -> float:
    """Compute the PSNR of a picture (H, W, 3) to a photograph, over its mask's pixels or, without a mask, over all."""
    error = (np.clip(colours, 0, 1) - view.colours / 255.0) ** 2
    counted = error if view.mask is None else error[view.mask]
    return -10 * math.log10(max(float(counted.mean()), 1e-12)) if counted.size else math.nan


def mean_psnr(
    scene: Scene, views: Sequence[Posed], effort: Effort, background: float, device: torch.device
) -> float | None:
    """Average the PSNR of views; None where there are none."""
    found = [picture(scene, view, effort, background, device).psnr for view in views]
    finite = [decibels for decibels in found if math.isfinite(decibels)]
    return sum(finite) / len(finite) if finite else None
