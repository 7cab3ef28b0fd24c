"""Mesh files by their endings, and the other files that they name."""

import json
import os
import re
import urllib.parse
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from .files import regular
from .references import Folder, UnresolvedError

SUFFIXES = (".ply", ".obj", ".stl", ".glb", ".gltf", ".off", ".3mf")
"""Suffixes of mesh files, in lower case."""
LONGEST_HEADER = 65_536
"""Largest length in bytes of the header of a PLY."""
LARGEST_JSON = 1 << 26
"""Largest length in bytes of a glTF that is searched."""


def mesh_files(path: Path, follow: bool = False) -> list[Path]:
    """List the files that a reader of a mesh reads: the mesh, the materials of an OBJ, their images, a glTF's data.

    follow: of `Folder`: whether those elsewhere are read, too.
    """
    folder, suffix = Folder(path.parent, follow), path.suffix.lower()
    named: list[Path] = []
    if suffix == ".obj":
        named += (library := _named(path, rb"mtllib", folder))
        named += [image for material in library for image in _named(material, rb"map_\w+", folder)]
    elif suffix == ".ply":
        named += _named(path, rb"comment[ \t]+TextureFile", folder, LONGEST_HEADER)
    elif suffix == ".gltf":
        named += _resources(path, folder)
    return [path, *dict.fromkeys(named)]


def _there(folder: Folder, names: Iterable[str]) -> list[Path]:
    """List the files of names, each once; none of those that are not read."""
    found: dict[Path, None] = {}
    for name in dict.fromkeys(names):
        with suppress(UnresolvedError):
            found[folder.file(name)] = None
    return [*found]


def _named(path: Path, keyword: bytes, folder: Folder, length: int = -1) -> list[Path]:
    """List the files that lines with a keyword name, in the first `length` bytes.

    Options before a name are skipped. A name with backslashes, or of another folder, may also be beside the file.
    """
    try:
        with regular(path).open("rb") as file:
            content = file.read(length) if path.is_file() else b""
    except OSError:
        return []
    values = re.findall(rb"^[ \t]*" + keyword + rb"[ \t]+(\S[^\r\n]*)", content, re.MULTILINE)
    names = [value.split()[-1] if value.startswith(b"-") else value.rstrip() for value in values]
    texts = [os.fsdecode(name) for name in names]
    return _there(folder, [each for text in texts for each in (text, re.split(r"[\\/]", text)[-1])])


def _resources(path: Path, folder: Folder) -> list[Path]:
    """List the buffers and images beside a glTF."""
    try:
        if path.stat().st_size > LARGEST_JSON:
            return []
        document = json.loads(regular(path).read_bytes())
        entries = [*document.get("buffers", []), *document.get("images", [])]
        names = [entry["uri"] for entry in entries if isinstance(entry.get("uri"), str)]
    except (OSError, ValueError, AttributeError, TypeError, KeyError, RecursionError):
        return []
    return _there(folder, [urllib.parse.unquote(name) for name in names if not name.startswith("data:")])
