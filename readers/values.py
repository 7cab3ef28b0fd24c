"""Values at the corners of faces: normals, colors, texture coordinates."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CornerValues:
    """Values at the corners of faces, indexed, since most corners around a vertex share one value."""

    values: Doubles
    """(N, K)."""
    index: NDArray[np.signedinteger[Any]]
    """(F, 3), the index of each corner's value."""

    def __getitem__(self, faces: Integers | slice) -> Doubles:
        """Return the values (M, 3, K) at the corners of faces (M,)."""
        return np.asarray(self.values[self.index[faces]])

    def at(self, faces: Integers, weights: Doubles) -> Doubles:
        """Interpolate (N, K) in faces (N,) at barycentric coordinates (N, 3, 1)."""
        return np.asarray((self[faces] * weights).sum(axis=1))

    def take(self, faces: NDArray[np.bool_]) -> "CornerValues":
        """Keep the faces of a mask (F,)."""
        return CornerValues(self.values, self.index[faces])

    def flipped(self, faces: NDArray[np.bool_]) -> "CornerValues":
        """Reverse the order of the corners of the faces of a mask (F,)."""
        return CornerValues(self.values, np.where(faces[:, None], self.index[:, ::-1], self.index))


def joined(parts: list[CornerValues]) -> CornerValues:
    """Concatenate the faces of several parts."""
    starts = np.cumsum([0] + [len(part.values) for part in parts])
    return CornerValues(
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.index + start for part, start in zip(parts, starts, strict=False)]),
    )
