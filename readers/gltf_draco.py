"""Decompresses KHR_draco_mesh_compression, by DracoPy (extra `formats`) in a process of its own."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from .child import child_of
from .frames import Arrays
from .gltf_accessors import normalized, view_bytes
from .gltf_file import DAMAGED, Gltf, needing


def decompressed(
    gltf: Gltf, compressed: dict[str, Any], attributes: dict[str, Any]
) -> tuple[dict[str, NDArray[Any]], NDArray[Any]]:
    """Return the attributes of a primitive by name, and its indices of vertices. Raises UserError.

    attributes: of the primitive; their accessors say which are normalized. Raises ModuleNotFoundError without DracoPy.
    """
    data = np.frombuffer(view_bytes(gltf, compressed.get("bufferView")), np.uint8)
    names = compressed.get("attributes", {})
    if not isinstance(names, dict) or not all(isinstance(number, int) for number in names.values()):
        raise UserError(f"{DAMAGED} (its Draco data: attributes without a number)")
    try:
        with needing("KHR_draco_mesh_compression"):
            numbers = sorted(set(names.values()))
            decoded = child_of(gltf).call(decoded_mesh, ("DracoPy",), gltf.claims.at_hand, data=data, numbers=numbers)
    except ValueError as error:
        raise UserError(f"{DAMAGED} (its Draco data: {show(str(error))[:60]})") from None
    found = {}
    for name, number in names.items():
        described = gltf.item("accessors", attributes.get(name))
        values = decoded[str(number)]
        found[name] = normalized(values) if described.get("normalized") else values
    return found, decoded["faces"]


def decoded_mesh(data: NDArray[np.uint8], numbers: list[int]) -> Arrays:
    """Return attributes (N, K) by their numbers, and indices of vertices (F * 3,) as "faces"."""
    import DracoPy

    mesh = DracoPy.decode(data.tobytes())
    attributes = {str(number): mesh.get_attribute_by_unique_id(number) for number in numbers}
    for number, attribute in attributes.items():
        if attribute is None:
            raise ValueError(f"it has no attribute {number}")
    found = {number: np.asarray(attribute["data"]) for number, attribute in attributes.items()}
    return found | {"faces": np.asarray(mesh.faces).reshape(-1)}
