"""Reads the materials of OBJ files: MTL files with colors and images."""

import os
import re
import shlex
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ..model.references import UnresolvedError
from .named_files import NamedFiles

NUMBERS = {"-s": 3, "-o": 3, "-t": 3, "-mm": 2, "-bm": 1, "-boost": 1, "-texres": 1}
"""Option of an image -> the most numbers after it."""
WORDS = {"-blendu", "-blendv", "-cc", "-clamp", "-imfchan", "-type"}
"""Options of an image with a word after them."""
IMAGES = ("map_kd", "map_ka")
"""Statements that name an image of the color, in the order of preference."""


@dataclass(frozen=True)
class ImageName:
    """An image of a material."""

    name: str
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    clamped: bool = False


@dataclass
class ObjMaterial:
    """A material of an MTL file."""

    color: tuple[float, float, float] | None = None
    """Kd, sRGB; None if the file has none."""
    image: ImageName | None = None
    rank: int = len(IMAGES)


def lines_of(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the keyword, in lower case, and the rest of each line; a backslash at its end continues a line."""
    text = path.read_bytes().decode("utf-8-sig", errors="surrogateescape")
    for line in re.sub(r"\\[ \t]*(\r\n|\r|\n)", " ", text).splitlines():
        words = line.strip().split(None, 1)
        if words and not words[0].startswith("#"):
            yield words[0].lower(), words[1].strip() if len(words) > 1 else ""


def read_materials(files: NamedFiles, libraries: Iterable[str]) -> tuple[dict[str, ObjMaterial], list[UnresolvedError]]:
    """Read the materials of MTL files, by name. Returns them, and why files are not read.

    libraries: what the lines `mtllib` of the OBJ have: one file whose name may have spaces, or several.
    """
    materials: dict[str, ObjMaterial] = {}
    missing, paths = list[UnresolvedError](), list[Path]()
    for library in dict.fromkeys(libraries):
        names = library.split()
        try:
            paths.append(files.file(library))
            continue
        except UnresolvedError as error:
            if len(names) < 2:
                missing.append(error)
                continue
        for name in names:
            try:
                paths.append(files.file(name))
            except UnresolvedError as error:
                missing.append(error)
    for place in dict.fromkeys(map(os.path.realpath, paths)):
        _read(Path(place), materials)
    return materials, missing


def _read(path: Path, materials: dict[str, ObjMaterial]) -> None:
    current = ObjMaterial()
    try:
        for keyword, rest in lines_of(path):
            if keyword == "newmtl":
                current = materials.setdefault(rest, ObjMaterial())
            elif keyword == "kd":
                current.color = _color(rest) or current.color
            elif keyword in IMAGES and IMAGES.index(keyword) < current.rank and rest:
                current.image, current.rank = image_name(rest), IMAGES.index(keyword)
    except OSError:
        return


def _color(text: str) -> tuple[float, float, float] | None:
    try:
        red, green, blue = (min(1.0, max(0.0, float(word))) for word in (text.split() * 3)[:3])
    except ValueError:
        return None
    return red, green, blue


def image_name(text: str) -> ImageName:
    """Read the options and the name of an image: "-s 1 1 1 -clamp on wood grain.png"."""
    try:
        words = shlex.split(text, posix=False) if '"' in text else text.split()
    except ValueError:
        words = text.split()
    found: dict[str, list[float]] = {}
    clamped, at = False, 0
    while at < len(words) and words[at].lower() in {*NUMBERS, *WORDS}:
        option = words[at].lower()
        at += 1
        if option in WORDS:
            clamped |= option == "-clamp" and words[at : at + 1] == ["on"]
            at += 1
            continue
        while at < len(words) and len(found.setdefault(option, [])) < NUMBERS[option] and _is_number(words[at]):
            found[option].append(float(words[at]))
            at += 1
    rest = text.split(None, at)[at] if at < len(text.split()) else ""

    def pair(option: str, default: float) -> tuple[float, float]:
        numbers = found.get(option, [])
        first = numbers[0] if numbers else default
        return first, numbers[1] if len(numbers) > 1 else default

    return ImageName(rest.strip().strip('"'), pair("-s", 1.0), pair("-o", 0.0), clamped)


def _is_number(word: str) -> bool:
    return re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", word) is not None
