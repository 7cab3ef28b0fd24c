"""SIRENs (Eq. 2) as plain tensors, and their value and gradient by one hand-written adjoint pass.

A network is a list [W_0, b_0, ..., W_n, b_n]; omega_0 is folded into every layer but the last, so that a hidden layer
is sin(W x + b). The adjoint pass keeps a_j = W_j h_{j-1} + b_j and runs u_{j-1} = (u_j W_j) * cos(a_{j-1}) backwards,
two matrix products a layer in all, where the paper's Algorithm 1 takes four. Its own derivative with respect to the
weights, which training needs, is written out by hand as well (`add_derivative`): four more.
"""

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ...model.model import Layer, Network

Weights = list[Tensor]
"""[W_0, b_0, ..., W_n, b_n]; W_j: (out, in), b_j: (out,)."""


def initial(
    size: tuple[int, int], omega: float, outputs: int, generator: torch.Generator, last: float = 1.0
) -> Weights:
    """A SIREN of size (width, depth) in the paper's notation, initialised as Sitzmann et al. (2020), section 3.2.

    omega: omega_0 of Eq. 2, the largest angular frequency of the first layer, radians per model unit and axis.
    last: factor on the output layer; a residual starts near zero with a small one.
    """
    width, depth = size

    def uniform(rows: int, columns: int, bound: float) -> Tensor:
        return (torch.rand(rows, columns, generator=generator) * 2 - 1) * bound

    # The first layer's phases fill the circle; further layers start with none.
    weights = [uniform(width, 3, omega / 3), uniform(1, width, math.pi)[0]]
    bound = math.sqrt(6 / width)  # sqrt(6 / n) / omega_0, times omega_0
    for _ in range(depth):
        weights += [uniform(width, width, bound), torch.zeros(width)]
    return [*weights, uniform(outputs, width, bound / omega * last), torch.zeros(outputs)]


def value(weights: Weights, points: Tensor) -> Tensor:
    """Value at points (n, 3): (n, outputs)."""
    hidden = points
    for weight, bias in zip(weights[:-2:2], weights[1:-2:2], strict=True):
        hidden = torch.addmm(bias, hidden, weight.t()).sin_()
    return torch.addmm(weights[-1], hidden, weights[-2].t())


@dataclass(frozen=True, eq=False)
class Adjoint:
    """f: (n,). gradient: (n, 3). The rest, of each sine layer j and (n, width), is what `add_derivative` needs.

    hidden: the points, then sin a_j. cosines: cos a_j. below: df/d(sin a_j), one row for all points at the top.
    adjoint: df/da_j.
    """

    f: Tensor
    gradient: Tensor
    hidden: list[Tensor]
    cosines: list[Tensor]
    below: list[Tensor]
    adjoint: list[Tensor]


@torch.no_grad()
def adjoint_pass(weights: Weights, points: Tensor) -> Adjoint:
    """Value and gradient at points (n, 3), of one output."""
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
def add_derivative(weights: Weights, of: Adjoint, d_f: Tensor, d_gradient: Tensor) -> None:
    """Adds to the weights' .grad the derivative of a loss whose own with respect to f and grad f are d_f, d_gradient.

    Uses up what `of` holds.
    """
    found = [weight.grad for weight in weights if weight.grad is not None]
    layers = len(of.cosines)

    # Back through the adjoint pass, upwards: d_below is dL/d(below[j]), bend is dL/d(cos a_j).
    found[0].addmm_(of.adjoint[0].t(), d_gradient)
    d_adjoint = d_gradient @ weights[0].t()
    bends = []
    for j in range(layers):
        bends.append(d_adjoint * of.below[j])
        d_below = d_adjoint.mul_(of.cosines[j])
        if j + 1 < layers:
            found[2 * j + 2].addmm_(of.adjoint[j + 1].t(), d_below)
            d_adjoint = d_below @ weights[2 * j + 2].t()
    found[-2] += d_below.sum(0) + d_f @ of.hidden[-1]
    found[-1] += d_f.sum()

    # Back through the values, downwards: da_j = dh_j * cos a_j - bend_j * sin a_j.
    d_hidden = d_f[:, None] * weights[-2]
    for j in range(layers - 1, -1, -1):
        d_angle = d_hidden.mul_(of.cosines[j]).addcmul_(bends[j], of.hidden[j + 1], value=-1)
        found[2 * j].addmm_(d_angle.t(), of.hidden[j])
        found[2 * j + 1] += d_angle.sum(0)
        if j:
            d_hidden = d_angle @ weights[2 * j]


@torch.no_grad()
def value_and_gradient(weights: Weights, points: Tensor) -> tuple[Tensor, Tensor]:
    """Value (n,) and gradient (n, 3) at points (n, 3), of one output, without a graph.

    `adjoint_pass`, but it keeps no more than the cosines.
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
    """value: (n, outputs). along: its derivative along the directions, (n, outputs).

    The rest is what `add_derivative_along` needs: hidden, tangents: what goes into each layer, points and directions
    first; cosines, products: cos a_j and W_j t_{j-1} of each sine layer.
    """

    value: Tensor
    along: Tensor
    hidden: list[Tensor]
    tangents: list[Tensor]
    cosines: list[Tensor]
    products: list[Tensor]


@torch.no_grad()
def value_along(weights: Weights, points: Tensor, directions: Tensor) -> Along:
    """Value at points (n, 3) and derivative along directions (n, 3), of every output.

    One tangent t_j = (W_j t_{j-1}) * cos a_j forwards: two products a layer, whatever the number of outputs, where
    their gradients would take one adjoint each.
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
def add_derivative_along(weights: Weights, of: Along, d_value: Tensor, d_along: Tensor) -> None:
    """Adds to the weights' .grad the derivative of a loss whose own with respect to value and along are d_*.

    Uses up what `of` holds.
    """
    found = [weight.grad for weight in weights if weight.grad is not None]
    found[-2].addmm_(d_value.t(), of.hidden[-1]).addmm_(d_along.t(), of.tangents[-1])
    found[-1] += d_value.sum(0)
    d_hidden, d_tangent = d_value @ weights[-2], d_along @ weights[-2]
    for j in range(len(of.cosines) - 1, -1, -1):
        bend = of.products[j].mul_(d_tangent)  # dL/d(cos a_j)
        d_angle = d_hidden.mul_(of.cosines[j]).addcmul_(bend, of.hidden[j + 1], value=-1)
        d_product = d_tangent.mul_(of.cosines[j])
        found[2 * j].addmm_(d_angle.t(), of.hidden[j]).addmm_(d_product.t(), of.tangents[j])
        found[2 * j + 1] += d_angle.sum(0)
        if j:
            d_hidden, d_tangent = d_angle @ weights[2 * j], d_product @ weights[2 * j]


def cos(angle: Tensor) -> Tensor:
    """Elementwise, without a graph."""
    if angle.is_cuda:
        return angle.cos()
    result = torch.empty_like(angle)
    np.cos(angle.numpy(), out=result.numpy())  # a third of PyTorch's time a core; error 7e-8, PyTorch's 4e-8
    return result


def sin_(angle: Tensor) -> Tensor:
    """Elementwise and in place, without a graph."""
    if angle.is_cuda:
        return angle.sin_()
    array = angle.numpy()
    np.sin(array, out=array)
    return angle


def clone(weights: Weights) -> Weights:
    """A copy that shares no memory."""
    return [w.clone() for w in weights]


def to_model(weights: Weights) -> Network:
    """The network as the model file holds it: float32 numpy, omega_0 folded in."""
    arrays = [np.ascontiguousarray(w.detach().cpu().numpy(), dtype=np.float32) for w in weights]
    return tuple(Layer(w, b) for w, b in zip(arrays[::2], arrays[1::2], strict=True))


def from_model(network: Network) -> Weights:
    """The inverse of `to_model`."""
    return [torch.from_numpy(array.copy()) for layer in network for array in (layer.weight, layer.bias)]
