"""The terms of the loss, one function each. Every term is a mean over its points.

f: (n,) values of f_i; gradient: (n, 3) of grad f_i.
"""

import torch
from torch import Tensor


def value(f: Tensor, distance: Tensor) -> Tensor:
    """First term of Eq. 4, f_i(x_j)^2, and its extension to points at a known distance, (f_i(x) - distance)^2.

    A distance of NaN is not known and adds nothing.
    """
    return (f - distance).nan_to_num().square().mean()


def normal(gradient: Tensor, normals: Tensor) -> Tensor:
    """Second term of Eq. 4, 1 - <grad f_i(x_j), N_j>, of the gradient's direction.

    With the gradient's own length the term would pay for |grad f| > 1, against the Eikonal term.
    """
    return (1 - torch.nn.functional.cosine_similarity(gradient, normals, dim=1)).mean()


def eikonal(gradient: Tensor) -> Tensor:
    """Third term of Eq. 4, (|grad f_i| - 1)^2 over Omega_{i-1}."""
    length: Tensor = torch.linalg.vector_norm(gradient, dim=1)
    return (length - 1).square().mean()


def colour(colours: Tensor, truth: Tensor) -> Tensor:
    """First term of the texture loss (Section 3.2, texture mapping), |g - truth|^2 on the surface. Both (n, 3)."""
    return (colours - truth).square().sum(dim=1).mean()


def constant_along_normals(along: Tensor) -> Tensor:
    """Second term of the texture loss, <grad g, grad f>^2 in the band |f| <= delta. along: (n, 3), a row per point."""
    return along.square().sum(dim=1).mean()
