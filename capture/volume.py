"""Volume rendering of a signed distance (NeuS, Wang et al. 2021): unbiased, and aware of occlusion."""

from collections.abc import Callable

import torch
from torch import Tensor

from .rays import Rays

SEEN = 1e-4  # sections with a smaller weight get no color: their radiance is not evaluated
TINY = 1e-5  # keeps quotients of small densities finite


def sections(rays: Rays, depths: Tensor) -> tuple[Tensor, Tensor]:
    """Cut rays at depths (R, S), ascending distances from the eyes; the last section ends where the ray ends.

    Returns the sections' centers (R, S, 3) and lengths (R, S).
    """
    lengths = torch.diff(depths, dim=1, append=rays.far[:, None])
    middles = depths + lengths / 2
    return rays.eyes[:, None] + middles[..., None] * rays.directions[:, None], lengths


def opacities(
    f: Tensor, gradient: Tensor, directions: Tensor, lengths: Tensor, sharpness: Tensor, anneal: float
) -> Tensor:
    """Compute the opacity alpha of sections, max(0, (Phi(f_a) - Phi(f_b)) / Phi(f_a)) (NeuS, Eq. 13).

    Phi is the logistic distribution function of sharpness s. f: (R, S) and gradient: (R, S, 3), at the centers; the
    values f_a and f_b at the ends of a section follow from the slope along the ray. directions: (R, 3). lengths:
    (R, S). anneal: in [0, 1]; below 1, sections in which the ray leaves the shape count a little, too, which helps an
    untrained field. Returns (R, S).
    """
    slope = (gradient * directions[:, None]).sum(dim=-1)
    falling = -(torch.relu(0.5 - 0.5 * slope) * (1 - anneal) + torch.relu(-slope) * anneal)
    return _alpha(f, falling * lengths / 2, sharpness)


def _alpha(f: Tensor, half: Tensor, sharpness: Tensor | float) -> Tensor:
    """Compute the opacity of sections from the value f at their centers, which changes by 2 `half` along them."""
    start, end = torch.sigmoid((f - half) * sharpness), torch.sigmoid((f + half) * sharpness)
    return ((start - end + TINY) / (start + TINY)).clamp(0, 1)


def weights_of(alpha: Tensor) -> Tensor:
    """Return the weight T_i alpha_i of each section in its ray's color. alpha: (R, S). Returns (R, S)."""
    through = torch.cumprod(torch.cat((torch.ones_like(alpha[:, :1]), 1 - alpha + 1e-7), dim=1), dim=1)
    return alpha * through[:, :-1]


@torch.no_grad()
def sample(
    rays: Rays,
    values: Callable[[Tensor], Tensor],
    counts: tuple[int, int],
    rounds: int,
    sharpest: float,
    generator: torch.Generator | None,
) -> Tensor:
    """Choose depths along rays: evenly first, then more of them near the surface of a coarse field.

    values: the coarse field at points (N, 3). counts: of even depths, and of all added depths. rounds: number of rounds
    that add depths; the sharpness of the field grows fourfold in each round, up to `sharpest`. generator: shifts the
    even depths of each ray randomly; None: no shift. Returns (R, S), ascending.
    """
    even, more = counts
    count, device = len(rays), rays.eyes.device
    share = torch.linspace(0, 1, even + 1, device=device)[:-1].expand(count, even)
    if generator is not None:
        share = share + torch.rand(count, 1, generator=generator).to(device) / even
    depths = rays.near[:, None] + (rays.far - rays.near)[:, None] * share
    f = _along(rays, values, depths)
    for k in range(rounds):
        sharpness = sharpest / 4.0 ** (rounds - 1 - k)
        added = _inverse(depths, _guide(depths, f, sharpness), more // rounds, generator)
        depths, order = torch.sort(torch.cat((depths, added), dim=1), dim=1)
        if k + 1 < rounds:
            f = torch.gather(torch.cat((f, _along(rays, values, added)), dim=1), 1, order)
    return depths


def _along(rays: Rays, values: Callable[[Tensor], Tensor], depths: Tensor) -> Tensor:
    points = rays.eyes[:, None] + depths[..., None] * rays.directions[:, None]
    return values(points.reshape(-1, 3)).reshape(depths.shape)


def _guide(depths: Tensor, f: Tensor, sharpness: float) -> Tensor:
    """Compute the weights (R, S - 1) of the intervals between depths (R, S) from the field at these depths (R, S)."""
    lengths = torch.diff(depths, dim=1)
    slope = torch.diff(f, dim=1) / (lengths + TINY)
    earlier = torch.cat((torch.zeros_like(slope[:, :1]), slope[:, :-1]), dim=1)
    slope = torch.minimum(slope, earlier).clamp(-1e3, 0)
    return weights_of(_alpha((f[:, 1:] + f[:, :-1]) / 2, slope * lengths / 2, sharpness))


def _inverse(depths: Tensor, weights: Tensor, count: int, generator: torch.Generator | None) -> Tensor:
    """Draw `count` depths a ray by inverting the distribution function of the intervals' weights (R, S - 1)."""
    density = weights + TINY
    below = torch.cumsum(density / density.sum(dim=1, keepdim=True), dim=1)
    below = torch.cat((torch.zeros_like(below[:, :1]), below), dim=1)
    u = ((torch.arange(count, device=depths.device) + 0.5) / count).expand(len(depths), count)
    if generator is not None:
        u = u + (torch.rand(len(depths), 1, generator=generator).to(depths.device) - 0.5) / count
    last = weights.shape[1] - 1
    index = (torch.searchsorted(below, u.contiguous(), right=True) - 1).clamp(0, last)
    start, end = torch.gather(below, 1, index), torch.gather(below, 1, index + 1)
    share = ((u - start) / (end - start).clamp_min(1e-8)).clamp(0, 1)
    first, second = torch.gather(depths, 1, index), torch.gather(depths, 1, index + 1)
    return first + share * (second - first)
