"""Renders whole views of a scene, and compares them with held-out photographs."""

import math
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from .photographs import Photograph
from .rays import rays_of
from .rendering import Effort, Scene, render

CHUNK = 2048  # rays per block, which bounds the memory


@torch.no_grad()
def render_view(
    scene: Scene, view: Photograph, effort: Effort, background: float, device: torch.device
) -> tuple[NDArray[np.float32], float]:
    """Render a view. background: gray, sRGB.

    Returns colors (H, W, 3), sRGB, not clamped, and the PSNR in decibels, over the mask's pixels if there is a mask.
    """
    rays, index = rays_of([view], device)
    width, height = view.size
    flat = np.full((height * width, 3), background, np.float32)
    for k in range(0, len(rays), CHUNK):
        rendered = render(scene, rays.take(slice(k, k + CHUNK)), effort)
        behind = background * (1 - rendered.opacity[:, None])
        flat[index[k : k + CHUNK].cpu().numpy()] = (rendered.colors + behind).cpu().numpy()
    colors = flat.reshape(height, width, 3)
    error = (np.clip(colors, 0, 1) - view.colors / 255.0) ** 2
    counted = error if view.mask is None else error[view.mask]
    psnr = -10 * math.log10(max(float(counted.mean()), 1e-12)) if counted.size else math.nan
    return colors, psnr


def mean_psnr(
    scene: Scene, views: Sequence[Photograph], effort: Effort, background: float, device: torch.device
) -> float | None:
    """Average the PSNR of views; None without views."""
    found = [render_view(scene, view, effort, background, device)[1] for view in views]
    finite = [decibels for decibels in found if math.isfinite(decibels)]
    return sum(finite) / len(finite) if finite else None
