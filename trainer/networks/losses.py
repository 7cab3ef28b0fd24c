"""The terms of the loss, one function each. Every term is a mean over its points; a level's come with derivatives.

f: (n,) values of f_i; gradient: (n, 3) of grad f_i.
"""

import torch
from torch import Tensor

SHORTEST = 1e-8
"""A gradient below this length counts as this long."""


def value(f: Tensor, distance: Tensor) -> tuple[Tensor, Tensor]:
    """First term of Eq. 4, f_i(x_j)^2, and its extension to points at a known distance, (f_i(x) - distance)^2.

    A distance of NaN is not known and adds nothing. Also the derivative with respect to f: (n,).
    """
    error = (f - distance).nan_to_num()
    return error.square().mean(), error * (2 / len(f))


def normal(gradient: Tensor, normals: Tensor) -> tuple[Tensor, Tensor]:
    """Second term of Eq. 4, 1 - <grad f_i(x_j), N_j>, of the gradient's direction. normals: (n, 3), of length one.

    With the gradient's own length the term would pay for |grad f| > 1, against the Eikonal term. Also the derivative
    with respect to the gradient: (n, 3).
    """
    shrink = 1 / _length(gradient)
    direction = gradient * shrink
    cosine = (direction * normals).sum(1, keepdim=True)
    return 1 - cosine.mean(), (direction * cosine - normals) * (shrink / len(gradient))


def eikonal(gradient: Tensor) -> tuple[Tensor, Tensor]:
    """Third term of Eq. 4, (|grad f_i| - 1)^2 over Omega_{i-1}, and its derivative with respect to the gradient."""
    length = _length(gradient)
    error = length - 1
    return error.square().mean(), gradient * (error / length * (2 / len(gradient)))


def _length(vectors: Tensor) -> Tensor:
    length: Tensor = torch.linalg.vector_norm(vectors, dim=1, keepdim=True)
    return length.clamp_min(SHORTEST)


def colour(colours: Tensor, truth: Tensor) -> tuple[Tensor, Tensor]:
    """First term of the texture loss (Section 3.2, texture mapping), |g - truth|^2 on the surface. Both (n, 3).

    Also the derivative with respect to g: (n, 3).
    """
    error = colours - truth
    return error.square().sum(dim=1).mean(), error * (2 / len(colours))


def constant_along_normals(along: Tensor) -> tuple[Tensor, Tensor]:
    """Second term of the texture loss, <grad g, grad f>^2 in the band |f| <= delta. along: (n, 3), a row per point.

    Also the derivative with respect to `along`: (n, 3).
    """
    return along.square().sum(dim=1).mean(), along * (2 / len(along))
