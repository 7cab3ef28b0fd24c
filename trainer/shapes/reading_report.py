"""What was taken from an input: one line that a person can check, and the same as numbers."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...readers.content import Cloud, Mesh
from ...readers.values import Doubles


@dataclass(frozen=True)
class ReadingReport:
    """The facts about an input."""

    name: str
    meshes: int
    """Meshes with their instances; 0 for a cloud."""
    triangles: int
    parts: int
    """Parts without common edges; 0 for a cloud."""
    points: int
    """Points of a cloud; vertices of a mesh."""
    normals: str
    """Of a cloud: "the file's" or "estimated"; of a mesh also "" for none."""
    colors: str
    """Where they come from; "" for none."""
    notes: tuple[str, ...]
    """Columns, the pose of a skin, and the like."""
    up: str
    """Axis of the file that points up."""
    height: float
    """Extent along this axis, in the file's units."""
    turned: int
    """Parts that were turned outward."""
    creases: float = 0.0
    """Length of a mesh's sharp edges, in radii of the shape; 0 where all edges are sharp (`--flat`)."""

    def line(self) -> str:
        """Return the line."""
        height = f"{self.height:,.4g}" if self.height < 1e5 else f"{self.height:.4g}"
        place = f"{self.up} up, {height} units tall"
        if self.meshes:
            some = [_counted(self.meshes, "mesh", "es"), _counted(self.triangles, "triangle")]
            some += [_counted(self.parts, "part"), self.colors or "no colors"]
            some += [f"{self.creases:.2g} radii of sharp edges"] * (self.creases > 0)
        else:
            some = [_counted(self.points, "point"), f"normals {self.normals}", self.colors or "no colors"]
        turned = ""
        if self.turned:
            turned = f"; turned {_counted(self.turned, 'part')} outward" if self.meshes else "; turned outward"
        return f"{self.name}: {', '.join([*some, *self.notes, place])}{turned}"

    def record(self) -> dict[str, Any]:
        """Return the facts for JSON."""
        return asdict(self) | {"notes": list(self.notes), "line": self.line()}


def _counted(count: int, noun: str, ending: str = "s") -> str:
    return f"{count:,} {noun}{ending if count != 1 else ''}"


def taken_of(
    content: Mesh | Cloud,
    name: str,
    up: str,
    *,
    parts: int,
    turned: int,
    creases: float = 0.0,
    estimated: bool = False,
) -> ReadingReport:
    """Return the facts about an input, which is upright already. up: the axis of the file that points up."""
    notes = tuple(content.facts.taken)
    if isinstance(content, Mesh):
        used: Doubles = content.vertices[np.unique(content.faces)]
        paint = content.paint
        colors = "" if paint is None else paint.words()
        normals = "" if content.normals is None else "the file's"
        meshes, triangles = content.facts.meshes, len(content.faces)
    else:
        used, meshes, triangles = content.points, 0, 0
        colors = "" if content.colors is None else "colors of points"
        normals = "estimated" if estimated else "of the file"
    height = float(np.ptp(used[:, 1])) if len(used) else 0.0
    return ReadingReport(name, meshes, triangles, parts, len(used), normals, colors, notes, up, height, turned, creases)
