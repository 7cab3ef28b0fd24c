"""SIRENs (Eq. 2) as plain tensors, with values and gradients by a hand-written adjoint pass.

A network is a list [W_0, b_0, ..., W_n, b_n]; omega_0 is folded into every layer but the last, so that a hidden layer
is sin(W x + b). The adjoint pass keeps a_j = W_j h_{j-1} + b_j and runs u_{j-1} = (u_j W_j) * cos(a_{j-1}) backwards:
two matrix products per layer, where the paper's Algorithm 1 needs four. Training also needs the derivative of that pass
by the weights, which is hand-written, too (`add_derivative`), and needs four more.
"""

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ...model.model import Layer, Network

TIME_FREQUENCY = 0.25
"""Largest initial frequency in time, relative to space: while t goes from 0 to 1, a surface moves by about its size,
and its coarse parts guide the motion."""

Weights = list[Tensor]
"""[W_0, b_0, ..., W_n, b_n]; W_j: (out, in), b_j: (out,)."""


def initial(
    size: tuple[int, int],
    omega: float,
    outputs: int,
    generator: torch.Generator,
    output_factor: float = 1.0,
    *,
    moving: bool = False,
) -> Weights:
    """Draw the weights of a new SIREN (Sitzmann et al. 2020, section 3.2).

    size: (width, depth) in the paper's notation. omega: omega_0 of Eq. 2, the largest angular frequency of the first
    layer, radians per model unit and axis. output_factor: scales the output layer; a small factor starts near zero.
    moving: a fourth input is a time in [0, 1], with frequencies up to `TIME_FREQUENCY` omega.
    """
    width, depth = size

    def uniform(rows: int, columns: int, bound: float) -> Tensor:
        return (torch.rand(rows, columns, generator=generator) * 2 - 1) * bound

    # The first layer's phases fill the circle; later layers start without phases.
    weights = [uniform(width, 3, omega / 3), uniform(1, width, math.pi)[0]]
    if moving:
        weights[0] = torch.cat((weights[0], uniform(width, 1, TIME_FREQUENCY * omega / 3)), dim=1)
    bound = math.sqrt(6 / width)  # sqrt(6 / n) / omega_0, times omega_0
    for _ in range(depth):
        weights += [uniform(width, width, bound), torch.zeros(width)]
    return [*weights, uniform(outputs, width, bound / omega * output_factor), torch.zeros(outputs)]


def value(weights: Weights, points: Tensor) -> Tensor:
    """Evaluate a network at points (N, 3). Returns (N, outputs)."""
    hidden = points
    for weight, bias in zip(weights[:-2:2], weights[1:-2:2], strict=True):
        hidden = torch.addmm(bias, hidden, weight.t()).sin_()
    return torch.addmm(weights[-1], hidden, weights[-2].t())


@dataclass(frozen=True, eq=False)
class Adjoint:
    """Value and gradient of a network, and the intermediate results (N, width) of each sine layer j."""

    f: Tensor
    """(N,)."""
    gradient: Tensor
    """(N, 3); (N, 4) with a time."""
    hidden: list[Tensor]
    """The points (N, 3), then sin a_j."""
    cosines: list[Tensor]
    """cos a_j."""
    below: list[Tensor]
    """df/d(sin a_j); one row for all points in the last layer."""
    adjoint: list[Tensor]
    """df/da_j."""


@torch.no_grad()
def adjoint_pass(weights: Weights, points: Tensor) -> Adjoint:
    """Evaluate value and gradient of a network with one output at points (N, 3), for `add_derivative`."""
    hidden, cosines = [points], []
    for weight, bias in zip(weights[:-2:2], weights[1:-2:2], strict=True):
        angle = torch.addmm(bias, hidden[-1], weight.t())
        cosines.append(cos(angle))
        hidden.append(sin_(angle))
    below = [weights[-2]]
    adjoint = [weights[-2] * cosines[-1]]
    for weight, cosine in zip(weights[-4:1:-2], cosines[-2::-1], strict=True):
        below.append(adjoint[-1] @ weight)
        adjoint.append(below[-1] * cosine)
    f = torch.addmv(weights[-1], hidden[-1], weights[-2][0])
    return Adjoint(f, adjoint[-1] @ weights[0], hidden, cosines, below[::-1], adjoint[::-1])


@torch.no_grad()
def add_derivative(
    weights: Weights, forward: Adjoint, d_f: Tensor, d_gradient: Tensor, d_last: Tensor | None = None
) -> None:
    """Add the derivative of a loss by the weights to their .grad, which must not be None.

    forward: of these weights; its tensors are overwritten. d_f: (N,), d_gradient: (N, 3): the loss's derivatives by f
    and grad f. d_last: (N, width), by the last hidden layer, if the loss depends on it directly.
    """
    grads = [weight.grad for weight in weights if weight.grad is not None]
    layers = len(forward.cosines)

    # Through the adjoint pass, upwards: d_below is dL/d(below[j]), bend is dL/d(cos a_j).
    grads[0].addmm_(forward.adjoint[0].t(), d_gradient)
    d_adjoint = d_gradient @ weights[0].t()
    bends = []
    for j in range(layers):
        bends.append(d_adjoint * forward.below[j])
        d_below = d_adjoint.mul_(forward.cosines[j])
        if j + 1 < layers:
            grads[2 * j + 2].addmm_(forward.adjoint[j + 1].t(), d_below)
            d_adjoint = d_below @ weights[2 * j + 2].t()
    grads[-2] += d_below.sum(0) + d_f @ forward.hidden[-1]
    grads[-1] += d_f.sum()

    # Through the values, downwards: da_j = dh_j * cos a_j - bend_j * sin a_j.
    d_hidden = d_f[:, None] * weights[-2]
    if d_last is not None:
        d_hidden += d_last
    for j in range(layers - 1, -1, -1):
        d_angle = d_hidden.mul_(forward.cosines[j]).addcmul_(bends[j], forward.hidden[j + 1], value=-1)
        grads[2 * j].addmm_(d_angle.t(), forward.hidden[j])
        grads[2 * j + 1] += d_angle.sum(0)
        if j:
            d_hidden = d_angle @ weights[2 * j]


@torch.no_grad()
def value_and_gradient(weights: Weights, points: Tensor) -> tuple[Tensor, Tensor]:
    """Evaluate value (N,) and gradient (N, 3) of a network with one output at points (N, 3).

    This is `adjoint_pass` in less memory: it keeps only the cosines.
    """
    hidden, cosines = points, []
    for weight, bias in zip(weights[:-2:2], weights[1:-2:2], strict=True):
        angle = torch.addmm(bias, hidden, weight.t())
        cosines.append(cos(angle))
        hidden = sin_(angle)
    adjoint = cosines.pop().mul_(weights[-2])
    for weight in weights[-4:1:-2]:
        adjoint = (adjoint @ weight).mul_(cosines.pop())
    return torch.addmv(weights[-1], hidden, weights[-2][0]), adjoint @ weights[0]


@dataclass(frozen=True, eq=False)
class Along:
    """Values and directional derivatives of a network, and the intermediate results of each sine layer j."""

    value: Tensor
    """(N, outputs)."""
    along: Tensor
    """Derivatives along the directions (N, outputs)."""
    hidden: list[Tensor]
    """The points (N, 3), then sin a_j (N, width)."""
    tangents: list[Tensor]
    """Derivatives of `hidden` along the directions: the directions (N, 3), then t_j (N, width)."""
    cosines: list[Tensor]
    """cos a_j (N, width)."""
    products: list[Tensor]
    """W_j t_{j-1} (N, width)."""


@torch.no_grad()
def value_along(weights: Weights, points: Tensor, directions: Tensor) -> Along:
    """Evaluate a network at points (N, 3), and the derivative of every output along directions (N, 3).

    One tangent t_j = (W_j t_{j-1}) * cos a_j is propagated forwards: two matrix products per layer for any number of
    outputs, whose gradients would need one adjoint pass each.
    """
    hidden, tangents, cosines, products = [points], [directions], [], []
    for weight, bias in zip(weights[:-2:2], weights[1:-2:2], strict=True):
        angle = torch.addmm(bias, hidden[-1], weight.t())
        products.append(tangents[-1] @ weight.t())
        cosines.append(cos(angle))
        tangents.append(products[-1] * cosines[-1])
        hidden.append(sin_(angle))
    value = torch.addmm(weights[-1], hidden[-1], weights[-2].t())
    return Along(value, tangents[-1] @ weights[-2].t(), hidden, tangents, cosines, products)


@torch.no_grad()
def add_derivative_along(weights: Weights, forward: Along, d_value: Tensor, d_along: Tensor) -> None:
    """Add the derivative of a loss by the weights to their .grad, which must not be None.

    forward: of these weights; its tensors are overwritten. d_value, d_along: (N, outputs), the loss's derivatives by
    the values and by their directional derivatives.
    """
    grads = [weight.grad for weight in weights if weight.grad is not None]
    grads[-2].addmm_(d_value.t(), forward.hidden[-1]).addmm_(d_along.t(), forward.tangents[-1])
    grads[-1] += d_value.sum(0)
    d_hidden, d_tangent = d_value @ weights[-2], d_along @ weights[-2]
    for j in range(len(forward.cosines) - 1, -1, -1):
        bend = forward.products[j].mul_(d_tangent)  # dL/d(cos a_j)
        d_angle = d_hidden.mul_(forward.cosines[j]).addcmul_(bend, forward.hidden[j + 1], value=-1)
        d_product = d_tangent.mul_(forward.cosines[j])
        grads[2 * j].addmm_(d_angle.t(), forward.hidden[j]).addmm_(d_product.t(), forward.tangents[j])
        grads[2 * j + 1] += d_angle.sum(0)
        if j:
            d_hidden, d_tangent = d_angle @ weights[2 * j], d_product @ weights[2 * j]


def cos(angle: Tensor) -> Tensor:
    """Compute cosines, without a graph."""
    if angle.is_cuda:
        return angle.cos()
    result = torch.empty_like(angle)
    np.cos(angle.numpy(), out=result.numpy())  # a third of PyTorch's time per core; error 7e-8, PyTorch's 4e-8
    return result


def sin_(angle: Tensor) -> Tensor:
    """Replace a tensor by its sines, without a graph."""
    if angle.is_cuda:
        return angle.sin_()
    array = angle.numpy()
    np.sin(array, out=array)
    return angle


def clone(weights: Weights) -> Weights:
    """Copy the weights to new memory."""
    return [w.clone() for w in weights]


def to_model(weights: Weights) -> Network:
    """Convert weights to the network of a model file: float32 arrays, omega_0 folded in."""
    arrays = [np.ascontiguousarray(w.detach().cpu().numpy(), dtype=np.float32) for w in weights]
    return tuple(Layer(w, b) for w, b in zip(arrays[::2], arrays[1::2], strict=True))


def from_model(network: Network) -> Weights:
    """Convert the network of a model file to weights on the CPU; the inverse of `to_model`."""
    return [torch.from_numpy(array.copy()) for layer in network for array in (layer.weight, layer.bias)]
