"""A pretended GPU: its tensors keep their data on the CPU, and an operation that mixes them with the CPU's fails.

The device is PyTorch's "meta", which autograd knows without a driver. Scalars that PyTorch itself puts there have no
value, so the few functions that make some are replaced here.
"""

from collections.abc import Sequence
from typing import Any

import torch
from torch.overrides import TorchFunctionMode
from torch.utils._pytree import tree_flatten, tree_map

DEVICE, CPU = torch.device("meta"), torch.device("cpu")
MOVES = {"_to_copy", "copy_"}
"""Operations that may take tensors of both devices; an index may be on the CPU."""
INDEXING = {"index", "index_put_", "_index_put_impl_"}


class OnGpu(torch.Tensor):
    """A tensor on the pretended GPU; `held` is its data."""

    held: torch.Tensor
    is_cuda = property(lambda _: True)

    @staticmethod
    def __new__(cls, held: torch.Tensor) -> "OnGpu":
        made: OnGpu = torch.Tensor._make_wrapper_subclass(
            cls,
            held.size(),
            strides=held.stride(),
            dtype=held.dtype,
            device=DEVICE,
            storage_offset=held.storage_offset(),
        )
        made.held = held
        return made

    @classmethod
    def __torch_dispatch__(  # type: ignore[override]
        cls, func: Any, _: object, args: Sequence[Any] = (), kwargs: dict[str, Any] | None = None
    ) -> Any:
        kwargs, name = kwargs or {}, func.overloadpacket.__name__
        tensors = [leaf for leaf in tree_flatten((args, kwargs))[0] if isinstance(leaf, torch.Tensor)]
        on_gpu = {id(tensor.held): tensor for tensor in tensors if isinstance(tensor, OnGpu)}
        of_cpu = [tensor for tensor in tensors if tensor.device == CPU and tensor.dim()]
        allowed = name in MOVES or (name in INDEXING and isinstance(args[0], OnGpu))
        if of_cpu and not allowed:
            raise RuntimeError(f"{name}: tensors on the CPU and on the GPU")

        def data(leaf: Any) -> Any:
            if isinstance(leaf, OnGpu):
                return leaf.held
            if isinstance(leaf, torch.Tensor) and leaf.device == DEVICE:  # of a derivative that is zero
                return torch.zeros(leaf.shape, dtype=leaf.dtype)
            return CPU if isinstance(leaf, torch.device) else leaf

        found = func(*tree_map(data, args), **tree_map(data, kwargs))
        stays = isinstance(args[0], OnGpu) if name == "copy_" else kwargs.get("device", DEVICE) == DEVICE

        def result(leaf: Any) -> Any:
            if not stays or not isinstance(leaf, torch.Tensor) or isinstance(leaf, OnGpu):
                return leaf
            return on_gpu[id(leaf)] if id(leaf) in on_gpu else OnGpu(leaf)

        return tree_map(result, found)


class Move(torch.autograd.Function):
    """Copies a tensor from one device to the other."""

    @staticmethod
    def forward(_: Any, tensor: torch.Tensor) -> torch.Tensor:
        return tensor.held.detach().clone() if isinstance(tensor, OnGpu) else OnGpu(tensor.detach().clone())

    @staticmethod
    def backward(_: Any, gradient: torch.Tensor) -> torch.Tensor:
        return gradient.held if isinstance(gradient, OnGpu) else OnGpu(gradient)


class PretendedGpu(TorchFunctionMode):
    """While it is active, tensors can be made on DEVICE and be moved there and back."""

    def __torch_function__(
        self, func: Any, types: object, args: Sequence[Any] = (), kwargs: dict[str, Any] | None = None
    ) -> Any:
        kwargs, name = dict(kwargs or {}), getattr(func, "__name__", "")
        first = args[0] if args else None

        def scalar(value: Any, like: torch.Tensor) -> torch.Tensor:
            return value if isinstance(value, torch.Tensor) else OnGpu(torch.tensor(value, dtype=like.dtype))

        if isinstance(first, torch.Tensor) and name in {"to", "cpu"}:
            named = [CPU] * (name == "cpu") + [torch.device(a) for a in args[1:] if isinstance(a, str | torch.device)]
            named += [a.device for a in args[1:] if isinstance(a, torch.Tensor)]
            if named:
                return first if first.device == named[0] else Move.apply(first)  # type: ignore[no-untyped-call]
        if torch.device(kwargs.get("device") or "cpu") == DEVICE:
            if kwargs.get("generator") is not None:
                raise RuntimeError(f"{name}: a generator of the CPU for a tensor on the GPU")
            needs_gradient = kwargs.pop("requires_grad", False)
            return OnGpu(func(*args, **kwargs | {"device": CPU})).requires_grad_(needs_gradient)
        if isinstance(first, OnGpu):
            if name == "numpy":
                raise TypeError("a tensor on the GPU cannot become an array")
            if name == "tolist":
                return first.held.tolist()
            if name == "where" and len(args) == 3:
                like = next((a for a in args[1:] if isinstance(a, torch.Tensor)), torch.empty(0))
                args = (first, scalar(args[1], like), scalar(args[2], like))
            if name == "__setitem__":
                args = (first, args[1], scalar(args[2], first))
            if name == "cosine_similarity":
                a, b = (torch.nn.functional.normalize(argument, dim=1) for argument in args[:2])
                return (a * b).sum(dim=1)
        return func(*args, **kwargs)
