"""Reads 3MF files, in a process of its own.

Why not a library: trimesh builds a tree of all XML, which takes 30 times its bytes, and unpacks pictures that nobody
asked for.
"""

import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..model.errors import UserError
from ..model.memory import check_claim
from .child import in_child
from .clouds import EMPTY
from .content import Facts, Mesh
from .frames import Arrays
from .threemf_model import Model, Object, Part, model_of
from .values import Doubles
from .xml_text import refuse_entities
from .zip_file import members

ROOT = "3d/3dmodel.model"
DEEPEST = 64  # objects inside of objects
A_BYTE = 6.0  # bytes of memory for a byte of XML: the text, twice, and its numbers
AN_ITEM, A_PLACE = 120, 1000  # bytes of memory for a vertex or a face, and for a place


def read_3mf(path: Path) -> Mesh:
    """Read all meshes in their places. Raises UserError."""
    found = in_child(decoded, (), path.stat().st_size, path=str(path))
    return Mesh(found["vertices"], found["faces"], facts=Facts(meshes=int(found["meshes"])))


def decoded(path: str) -> Arrays:
    """Return "vertices" (V, 3), "faces" (F, 3), and how many "meshes" there are. Raises UserError."""
    size = Path(path).stat().st_size
    with zipfile.ZipFile(path) as archive:
        package = Package(archive, size)
        items = package.model(package.root).items
        count, places = package.extent(items)
        check_claim(AN_ITEM * count + A_PLACE * places, f"{count:,} vertices and faces in {places:,} places", size)
        placed = [(thing, matrix) for thing, matrix in package.placed(items) if len(thing.faces)]
    if not placed:
        raise UserError(EMPTY)
    starts = np.cumsum([0] + [len(thing.vertices) for thing, _ in placed])
    return {
        "vertices": np.concatenate([thing.vertices @ matrix[:3] + matrix[3] for thing, matrix in placed]),
        "faces": np.concatenate([thing.faces + start for (thing, _), start in zip(placed, starts, strict=False)]),
        "meshes": np.array(len(placed)),
    }


@dataclass
class Package:
    """The models of an archive; each is unpacked when it is asked for, pictures never."""

    archive: zipfile.ZipFile
    size: int
    """Bytes of the archive."""

    def __post_init__(self) -> None:
        self._members = {info.filename.strip("/").lower(): info for info in members(self.archive)}
        self._models: dict[str, Model] = {}
        self._unpacked = 0

    @property
    def root(self) -> str:
        """The name of the model that has the build. Raises UserError."""
        name = next((name for name in self._members if ROOT in name), None)
        if name is None:
            raise UserError("not a readable 3MF file (it has no 3D/3dmodel.model)")
        return name

    def model(self, name: str) -> Model:
        """Return a model by the name of its member. Raises UserError."""
        if name not in self._models:
            info = self._members.get(name)
            if info is None:
                raise UserError(f"not a readable 3MF file (it has no {name[:60]!a})")
            self._unpacked += info.file_size
            check_claim(A_BYTE * self._unpacked, f"models of {self._unpacked:,} bytes, unpacked", self.size)
            with self.archive.open(info) as file:
                xml = file.read(info.file_size)
            refuse_entities(xml)
            self._models[name] = model_of(xml, name)
        return self._models[name]

    def object(self, part: Part) -> Object:
        """Return what a part of a build or of an object is; an empty object where it is not there."""
        return self.model(part.model).objects.get(part.id, Object())

    def extent(self, parts: list[Part]) -> tuple[int, int]:
        """Return how many vertices and faces, and how many places, parts have in all. Raises UserError for a loop."""
        known: dict[tuple[str, str], tuple[int, int]] = {}

        def of_part(part: Part, depth: int) -> tuple[int, int]:
            if depth > DEEPEST:
                raise UserError(f"not a readable 3MF file (objects inside of objects, {DEEPEST} deep)")
            if part.key not in known:
                found = self.object(part)
                inner = [of_part(each, depth + 1) for each in found.components]
                count = len(found.vertices) + len(found.faces)
                known[part.key] = count + sum(each for each, _ in inner), 1 + sum(each for _, each in inner)
            return known[part.key]

        extents = [of_part(part, 0) for part in parts]
        return sum(count for count, _ in extents), sum(places for _, places in extents)

    def placed(self, parts: list[Part]) -> Iterator[tuple[Object, Doubles]]:
        """Yield each object of parts, and of the objects in them, with its matrix (4, 3) for rows of points."""
        waiting = [(part, part.matrix) for part in reversed(parts)]
        while waiting:
            part, matrix = waiting.pop()
            found = self.object(part)
            yield found, matrix
            waiting += [(each, _after(each.matrix, matrix)) for each in reversed(found.components)]


def _after(inner: Doubles, outer: Doubles) -> Doubles:
    """Return the matrix that applies `inner`, then `outer`."""
    joined = inner @ outer[:3]
    joined[3] += outer[3]
    return joined
