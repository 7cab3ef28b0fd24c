"""Parses a model of 3MF: its objects, and what is built of them."""

from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.parsers import expat

import numpy as np

from ..model.errors import UserError
from .values import Doubles, Integers

PLAIN = np.concatenate((np.eye(3), np.zeros((1, 3))))


@dataclass(frozen=True, eq=False)
class Part:
    """An object in its place."""

    model: str
    """Name of the archive's member that has the object."""
    id: str
    matrix: Doubles
    """(4, 3): a point p goes to p @ matrix[:3] + matrix[3]."""

    @property
    def key(self) -> tuple[str, str]:
        """What the object is known by."""
        return self.model, self.id


@dataclass
class Object:
    """A mesh, other objects in their places, or nothing."""

    numbers: "array[float]" = field(default_factory=lambda: array("d"))
    corners: "array[int]" = field(default_factory=lambda: array("q"))
    start: int = 0
    """Vertices before those of the mesh that is parsed."""
    components: list[Part] = field(default_factory=list)

    @property
    def vertices(self) -> Doubles:
        """(V, 3)."""
        return np.frombuffer(self.numbers, np.float64).reshape(-1, 3)

    @property
    def faces(self) -> Integers:
        """(F, 3), indices of vertices."""
        return np.frombuffer(self.corners, np.int64).reshape(-1, 3)


@dataclass
class Model:
    """The objects of a member by id, and the items of its build."""

    objects: dict[str, Object] = field(default_factory=dict)
    items: list[Part] = field(default_factory=list)


def model_of(xml: bytes, name: str) -> Model:
    """Parse a member without entities. name: of the member. Raises UserError."""
    model = Model()
    current = Object()
    prefix: str | None = None

    def start(tag: str, values: Mapping[str, str]) -> None:
        nonlocal current, prefix
        prefix = tag.removesuffix("model") if prefix is None else prefix
        # Other prefixes are extensions', whose vertices are none of a mesh.
        match tag.removeprefix(prefix):
            case "vertex":
                current.numbers.extend((float(values["x"]), float(values["y"]), float(values["z"])))
            case "triangle":
                first = current.start
                current.corners.extend(first + int(values[corner]) for corner in ("v1", "v2", "v3"))
            case "object":
                current = model.objects.setdefault(values["id"], Object())
            case "mesh":
                current.start = len(current.numbers) // 3
            case "component":
                current.components.append(_part(values, name))
            case "item":
                model.items.append(_part(values, name))

    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    try:
        parser.Parse(xml, True)
    except expat.ExpatError as error:
        raise UserError(f"not a readable 3MF file ({error})") from None
    except KeyError as error:
        raise UserError(f"not a readable 3MF file (an element without {error})") from None
    for each in model.objects.values():
        if len(each.faces) and not 0 <= each.faces.min() <= each.faces.max() < len(each.vertices):
            raise UserError("faces refer to missing vertices")
    return model


def _part(values: Mapping[str, str], name: str) -> Part:
    """Return the object that a component or an item names, in this member or, by a path, in another."""
    path = next((value for key, value in values.items() if key.rpartition(":")[2] == "path"), name)
    matrix = PLAIN
    if text := values.get("transform"):
        matrix = np.array(text.split(), np.float64).reshape(4, 3)
    return Part(path.strip("/").lower(), values["objectid"], matrix)
