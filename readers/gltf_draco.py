"""Decompresses KHR_draco_mesh_compression, by DracoPy (extra `formats`)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import UserError
from ..model.files import show
from .gltf_accessors import normalized, view_bytes
from .gltf_file import DAMAGED, Gltf, needing


def decompressed(
    gltf: Gltf, compressed: dict[str, Any], attributes: dict[str, Any]
) -> tuple[dict[str, NDArray[Any]], NDArray[Any]]:
    """Return the attributes of a primitive by name, and its indices of vertices. Raises UserError.

    attributes: of the primitive; their accessors say which are normalized. Raises ModuleNotFoundError without DracoPy.
    """
    with needing("KHR_draco_mesh_compression"):
        import DracoPy

    data = view_bytes(gltf, compressed.get("bufferView"))
    try:
        mesh = DracoPy.decode(data)
        names = compressed.get("attributes", {})
        found = {}
        for name, number in names.items():
            values = np.asarray(mesh.get_attribute_by_unique_id(number)["data"])
            described = gltf.item("accessors", attributes.get(name))
            found[name] = normalized(values) if described.get("normalized") else values
        return found, np.asarray(mesh.faces).reshape(-1)
    except UserError:
        raise
    except Exception as error:  # DracoPy raises anything on damaged data
        raise UserError(f"{DAMAGED} (its Draco data: {show(str(error))[:60]})") from None
