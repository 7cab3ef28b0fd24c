"""The terms of the losses, one function each.

A term is a mean over its points. Every function returns the term and its derivative. f: (N,) and gradient: (N, 3) are
the values of f_i and grad f_i at the points.
"""

import torch
from torch import Tensor

SHORTEST = 1e-8  # least length of a gradient in divisions
LACK = 0.3  # a value off the surface is too small below this share of the distance, signs included


def value(f: Tensor, distance: Tensor) -> tuple[Tensor, Tensor]:
    """Compute the first term of Eq. 4, f_i(x_j)^2, extended to points at a known distance: (f_i(x) - distance)^2.

    distance: (N,); NaN where unknown, which adds nothing. Returns the term, and its derivative (N,) by f.
    """
    error = (f - distance).nan_to_num()
    return error.square().mean(), error * (2 / len(f))


def distance(f: Tensor, truth: Tensor, excess: float, lacking: float, near: float) -> tuple[Tensor, Tensor]:
    """Compute the term of values off the surface: the mean of w (f_i(x) - truth)^2.

    truth: signed distances (N,); NaN where unknown, which adds nothing. Too large a value may move a ray through
    the surface; too small a value, or one with the wrong sign, may create surface: w is `excess` where
    |f| > |truth| > near, `lacking` where f is less than LACK of the distance, else 1. Returns the term, and its
    derivative (N,) by f.
    """
    error = (f - truth).nan_to_num()
    size = truth.abs()
    weighted = torch.where((f.abs() > size) & (size > near), excess * error, error)
    if lacking != 1.0:
        weighted = torch.where(f * truth.sign() < LACK * size, lacking * error, weighted)
    return (weighted * error).mean(), weighted * (2 / len(f))


def normal(gradient: Tensor, normals: Tensor) -> tuple[Tensor, Tensor]:
    """Compute the second term of Eq. 4, 1 - <grad f_i(x_j), N_j>, with the gradient scaled to length one.

    With the gradient's own length, the term would reward |grad f| > 1, against the Eikonal term. normals: (N, 3), unit
    vectors. Returns the term, and its derivative (N, 3) by the gradient.
    """
    shrink = 1 / _length(gradient)
    direction = gradient * shrink
    cosine = (direction * normals).sum(1, keepdim=True)
    return 1 - cosine.mean(), (direction * cosine - normals) * (shrink / len(gradient))


def eikonal(gradient: Tensor) -> tuple[Tensor, Tensor]:
    """Compute the third term of Eq. 4, (|grad f_i| - 1)^2 over Omega_{i-1}, and its derivative by the gradient."""
    length = _length(gradient)
    error = length - 1
    return error.square().mean(), gradient * (error / length * (2 / len(gradient)))


def _length(vectors: Tensor) -> Tensor:
    length: Tensor = torch.linalg.vector_norm(vectors, dim=1, keepdim=True)
    return length.clamp_min(SHORTEST)


def color(colors: Tensor, truth: Tensor) -> tuple[Tensor, Tensor]:
    """Compute the first term of the texture loss (Section 3.2, texture mapping), |g - truth|^2 on the surface.

    colors, truth: (N, 3), values of g and true colors. Returns the term, and its derivative (N, 3) by g.
    """
    error = colors - truth
    return error.square().sum(dim=1).mean(), error * (2 / len(colors))


def constant_along_normals(along: Tensor) -> tuple[Tensor, Tensor]:
    """Compute the second term of the texture loss, <grad g, grad f>^2 in the band |f| <= delta.

    along: (N, 3), <grad g, grad f> of each channel. Returns the term, and its derivative (N, 3) by `along`.
    """
    return along.square().sum(dim=1).mean(), along * (2 / len(along))
