"""The file of a scene (TOML): reading it, with its models and inner scenes."""

import hashlib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..model.checks import check_finite
from ..model.errors import UserError
from ..model.expression import LARGEST, Expression
from ..model.files import show
from ..model.gallery import FOLDER, SUFFIX, names
from ..model.model import MOST_MODELS, Model
from ..model.model_file import load
from ..model.orientation import check_front
from ..model.references import Folder, UnresolvedError
from ..model.scene import (
    MOST_DEPTH,
    MOST_SHAPES,
    PLACEMENT_KEYS,
    SMALLEST_SCALE,
    UNION,
    Group,
    Node,
    Shape,
    check_formulas,
    color,
    expression,
    extent,
    group,
    placed,
    renumbered,
    shapes_of,
)
from .toml_lines import line_of

GROUP_KEYS = ("operation", "radius", "parts")
"""Keys of a group, beside `PLACEMENT_KEYS`."""
SHAPE_KEYS = ("model", "time")
"""Keys of a shape, beside `PLACEMENT_KEYS`."""
GROUND_KEYS = ("height", "radius", "thickness", "color")
"""Optional keys of the table `ground`."""
SCENE_KEYS = ("name", "credit", "front", "ground", *GROUP_KEYS)
"""Keys at the top of a scene's file."""
GROUND_COLOR = (0.72, 0.70, 0.66)
"""Default color of the ground, sRGB."""
LARGEST_FILE = 1_000_000
"""Largest size of the file, bytes."""
MOST_WORK = 50_000_000
"""Largest product of the dots in a line, and of all dots and lines: the parser takes some seconds for it, because it
walks down a key `a.a.a`, or the header above, for each of their parts and of the lines."""


@dataclass(frozen=True)
class Ground:
    """A round plate under the scene. Lengths are in the scene's unit; None: from the shapes."""

    height: float | None
    """Height of the upper side, along y."""
    radius: float | None
    thickness: float | None
    color: tuple[float, float, float]
    """sRGB in [0, 1]."""


@dataclass
class SceneFile:
    """The content of a scene's file, with its models."""

    name: str
    """Name of the model; by default the name of the file."""
    root: Group
    """The tree, in the file's unit."""
    ground: Ground | None
    credit: str | None
    front: tuple[float, float] | None
    """`Model.front`."""
    sha256: str
    """Hash of the file, hexadecimal."""
    models: list[Model] = field(default_factory=list)
    """Distinct models; the shapes of the tree hold indices into this list."""
    files: list[Path] = field(default_factory=list)
    """All files that were read."""


def read_scene(path: Path, follow: bool = False) -> SceneFile:
    """Read and check a scene. follow: of `Folder`. Raises UserError, which names the file, the line and the key."""
    return _Reader(follow).scene(path, [])


class _Reader:
    """Reads a scene and its inner scenes, and loads each model once."""

    def __init__(self, follow: bool) -> None:
        self._follow = follow
        self._models: list[Model] = []
        self._first: dict[Path, int] = {}
        """Path of a model -> index of the model, or of its first shape if it is a scene."""
        self._scenes: dict[Path, Model] = {}
        self._files: list[Path] = []
        self._texts: dict[Path, tuple[str, dict[str, Any], str]] = {}
        """Path of a scene -> its text, its values, and the hash of the file."""
        self._shapes = 0
        self._formulas = 0

    def scene(self, path: Path, outer: list[Path]) -> SceneFile:
        """Read one file. outer: resolved paths of the outer scenes."""
        place = path.resolve()
        if place not in self._texts:
            self._texts[place] = _parsed(path)
            self._files.append(path)
        text, values, sha256 = self._texts[place]
        try:
            return self._scene(path, values, [*outer, place], sha256)
        except _InnerError as error:
            raise error.inner from None
        except UserError as error:
            key, _, message = str(error).lstrip(".").partition(": ")
            raise UserError(f"{show(path)}:{line_of(text, key)}: {show(key)}: {message}") from None

    def _scene(self, path: Path, values: dict[str, Any], outer: list[Path], sha256: str) -> SceneFile:
        _check_known(values, SCENE_KEYS, "")
        texts = {key: values.get(key) for key in ("name", "credit")}
        for key, text in texts.items():
            if key in values and (not isinstance(text, str) or not text):
                raise UserError(f"{key}: a text is needed")
        if "front" in values:
            check_front(values["front"])
        ground = _ground(values["ground"]) if "ground" in values else None
        if ground is not None and len(outer) > 1:
            raise UserError("ground: only the outermost scene has one")
        self._formulas += extent(values)[1]
        check_formulas(self._formulas, "parts")
        root = self._group(values, "", path, outer)
        front = (float(values["front"][0]), float(values["front"][1])) if "front" in values else None
        name, credit = texts["name"] or path.stem, texts["credit"]
        return SceneFile(name, root, ground, credit, front, sha256, self._models, self._files)

    def _group(self, values: Mapping[str, Any], where: str, path: Path, outer: list[Path]) -> Group:
        parts = values.get("parts")
        if not isinstance(parts, list) or not parts:
            raise UserError(f"{where}.parts: a scene has [[parts]], one or more")
        if where.count("parts") >= MOST_DEPTH:
            raise UserError(f"{where}.parts: groups are at most {MOST_DEPTH} deep")
        nodes = tuple(self._part(part, f"{where}.parts[{i}]", path, outer) for i, part in enumerate(parts, start=1))
        return group(values, nodes, placed(values, where), where)

    def _part(self, values: Any, where: str, path: Path, outer: list[Path]) -> Node:
        if not isinstance(values, dict):
            raise UserError(f"{where}: a table is needed")
        if "parts" in values:
            _check_known(values, (*GROUP_KEYS, *PLACEMENT_KEYS), where)
            return self._group(values, where, path, outer)
        _check_known(values, (*SHAPE_KEYS, *PLACEMENT_KEYS), where)
        named = values.get("model")
        if not isinstance(named, str) or not named or "\0" in named:
            raise UserError(f"{where}.model: a part has a model, or parts of its own")
        placement, time = placed(values, where), expression(values, "time", Expression("t"), where)
        source = _source(Folder(path.parent, self._follow), named, f"{where}.model")
        if source.suffix.lower() == ".toml":
            if source.resolve() in outer:
                raise UserError(f"{where}.model: {show(named)} is a scene that contains itself")
            if len(outer) >= MOST_DEPTH:
                raise UserError(f"{where}.model: scenes are at most {MOST_DEPTH} deep")
            try:
                inner = self.scene(source, outer)
            except UserError as error:
                raise _InnerError(error) from None
            return Group(UNION, (inner.root,), placement=placement)
        first = self._first.get(source.resolve())
        try:
            model = load(source) if first is None else None
        except UserError as error:
            raise UserError(f"{where}.model: {error}") from None
        if model is not None:
            self._files.append(source)
            first = self._first[source.resolve()] = len(self._models)
            shapes = model.shapes or (model,)
            if first + len(shapes) > MOST_MODELS:
                raise UserError(f"{where}.model: a scene has at most {MOST_MODELS} models")
            self._models += [replace(shape, provenance={}) for shape in shapes]
            self._scenes |= {source.resolve(): model} if model.scene is not None else {}
        assert first is not None
        scene = self._scenes.get(source.resolve())
        self._count(1 if scene is None else sum(1 for _ in shapes_of(scene.scene or Group(UNION, ()))), where)
        if scene is None:
            return Shape(first, time, placement)
        assert scene.scene is not None
        if "time" in values:
            raise UserError(f"{where}.time: {show(named)} is a scene, which takes the time of the outer scene")
        start = first
        return Group(UNION, (renumbered(scene.scene, lambda number: number + start),), placement=placement)

    def _count(self, shapes: int, where: str) -> None:
        """Count shapes before they are built: a short file can name very many. Raises UserError."""
        self._shapes += shapes
        if self._shapes > MOST_SHAPES:
            raise UserError(f"{where}: more than {MOST_SHAPES} shapes")


class _InnerError(UserError):
    """An error in an inner scene, which names its own file and line."""

    def __init__(self, inner: UserError) -> None:
        super().__init__(str(inner))
        self.inner = inner


def _parsed(path: Path) -> tuple[str, dict[str, Any], str]:
    """Return the text of a scene, its values, and the hash of the file. Raises UserError."""
    data = _bytes(path)
    dots = [line.count(b".") for line in data.split(b"\n")]
    if max(dots) * (sum(dots) + len(dots)) > MOST_WORK:
        raise UserError(f"{show(path)}: a line with {max(dots):,} dots; write shorter lines")
    try:
        text = data.decode()
        return text, tomllib.loads(text), hashlib.sha256(data).hexdigest()
    except (ValueError, RecursionError) as error:
        raise UserError(f"{show(path)}: not TOML ({show(str(error))[:100]})") from None


def _bytes(path: Path) -> bytes:
    """Read a scene's file. Raises UserError."""
    try:
        if not path.is_file():
            raise UserError(f"{show(path)}: " + ("not a file" if path.exists() else "no such file"))
        if path.stat().st_size > LARGEST_FILE:
            raise UserError(f"{show(path)}: more than {LARGEST_FILE:,} bytes; a scene is smaller")
        return path.read_bytes()
    except (OSError, ValueError) as error:
        raise UserError(f"{show(path)}: {show(getattr(error, 'strerror', None) or str(error))}") from None


def _source(folder: Folder, named: str, key: str) -> Path:
    """Return the file of a part: below the scene's folder, or in the gallery. Raises UserError."""
    try:
        if (found := folder.find(named)) is not None:
            return found
    except UnresolvedError as error:
        raise UserError(f"{key}: {error}") from None
    if named in names():
        return FOLDER / (named + SUFFIX)
    raise UserError(f"{key}: {show(named)}: no such file, and not in the gallery: {', '.join(names())}")


def _ground(values: Any) -> Ground:
    if not isinstance(values, dict):
        raise UserError("ground: a table is needed")
    _check_known(values, GROUND_KEYS, "ground")
    for key in ("radius", "thickness", "height"):
        if key in values:
            check_finite(f"ground.{key}", values[key])
            least, words = (-LARGEST, "") if key == "height" else (SMALLEST_SCALE, "must be positive, ")
            if not least <= values[key] <= LARGEST:
                raise UserError(f"ground.{key}: {words}at most {LARGEST:,.0f}")
    painted = color(values["color"], "ground") if "color" in values else GROUND_COLOR
    return Ground(values.get("height"), values.get("radius"), values.get("thickness"), painted)


def _check_known(values: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    """Raise UserError for unknown keys of a table."""
    for key in values:
        if key not in known:
            raise UserError(f"{where}.{key}: unknown key; choose one of {', '.join(known)}")
