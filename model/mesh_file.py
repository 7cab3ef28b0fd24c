"""Mesh files by their endings, and the other files that they name."""

import json
import os
import re
import urllib.parse
from pathlib import Path

from .files import regular

SUFFIXES = (".ply", ".obj", ".stl", ".glb", ".gltf", ".off", ".3mf")
"""Suffixes of mesh files, in lower case."""
LONGEST_HEADER = 65_536
"""Largest length in bytes of the header of a PLY."""
LARGEST_JSON = 1 << 26
"""Largest length in bytes of a glTF that is searched."""


def mesh_files(path: Path) -> list[Path]:
    """List the files that a reader of a mesh reads: the mesh, the materials of an OBJ, their images, a glTF's data."""
    files, suffix = [path], path.suffix.lower()
    if suffix == ".obj":
        files += (library := _named(path, rb"mtllib"))
        files += [image for material in library for image in _named(material, rb"map_\w+")]
    elif suffix == ".ply":
        files += _named(path, rb"comment[ \t]+TextureFile", LONGEST_HEADER)
    elif suffix == ".gltf":
        files += _resources(path)
    return files


def _named(path: Path, keyword: bytes, length: int = -1) -> list[Path]:
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
    found: list[Path] = []
    for name in (os.fsdecode(name) for name in names if b"\0" not in name):
        parts = [part for part in re.split(r"[\\/]+", name) if part not in ("", ".")]
        places = [path.parent / name, path.parent.joinpath(*parts), path.parent / (parts[-1] if parts else name)]
        found += dict.fromkeys(places)
    return found


def _resources(path: Path) -> list[Path]:
    """List the buffers and images beside a glTF."""
    try:
        if path.stat().st_size > LARGEST_JSON:
            return []
        document = json.loads(regular(path).read_bytes())
        entries = [*document.get("buffers", []), *document.get("images", [])]
        names = [entry["uri"] for entry in entries if isinstance(entry.get("uri"), str)]
    except (OSError, ValueError, AttributeError, TypeError, KeyError, RecursionError):
        return []
    return [path.parent / urllib.parse.unquote(name) for name in names if ":" not in name and "\0" not in name]
