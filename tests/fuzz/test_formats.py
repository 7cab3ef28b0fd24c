"""Damaged files of every format that a library decodes, and of COLMAP: one line each, within limits; no contact.

A server and a file outside of the folder stand by, which files name. Each case has the limits of `survive`; native
decoders keep their process from case to case, unless it ends.
"""

import io
import socket
import sys
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest
import trimesh
from PIL import Image

from mplicits.capture.folder import read_photographs
from mplicits.readers.child import Child, Decoder
from mplicits.readers.frames import Arrays
from mplicits.readers.read import read_shape
from support.colmap import write_colmap
from support.e57_pages import with_checksums, with_lengths, without_checksums
from support.fuzzing import Case, damaged, fresh_seed, survive
from support.library_files import WRITERS
from support.standby import standby

CASES = Path(__file__).parent / "cases"
FAST, MANY = 30, 10_000
"""Cases of a kind."""


def obj(path: Path) -> None:
    """Write a ball with a material and an image."""
    Image.new("RGB", (2, 2)).save(path.with_name("skin.png"))
    path.with_name("a.mtl").write_text("newmtl m\nmap_Kd skin.png\nKd 1 0 0\n")
    text: Any = trimesh.creation.icosphere(1).export(file_type="obj")
    path.write_text(f"mtllib a.mtl\nusemtl m\n{text}")


def gltf(path: Path) -> None:
    """Write a ball with its arrays beside it."""
    scene: Any = trimesh.Scene(trimesh.creation.icosphere(1))
    for name, data in scene.export(file_type="gltf").items():
        (path if name.endswith(".gltf") else path.with_name(name)).write_bytes(data)


def textured_ply(path: Path) -> None:
    data: Any = trimesh.creation.icosphere(1).export(file_type="ply", encoding="ascii")
    path.write_bytes(data.replace(b"format ascii 1.0\n", b"format ascii 1.0\ncomment TextureFile skin.png\n"))


NAMES = (b"skin.png", b"a.mtl", b"gltf_buffer_0.bin", b"gltf_buffer_1.bin")
"""Names in the files."""
FORMATS = WRITERS | {"a.obj": obj, "a.gltf": gltf, "texture.ply": textured_ply}


def colmap(folder: Path) -> list[Case]:
    write_colmap(folder, binary=True)
    return [(name, (folder / "sparse" / "0" / name).read_bytes()) for name in ("images.bin", "cameras.bin")]


def use_colmap(path: Path) -> None:
    """Read the folder with one file replaced."""
    name = "images.bin" if "images" in path.name else "cameras.bin"
    place = path.parent / "sparse" / "0" / name
    whole = place.read_bytes()
    try:
        place.write_bytes(path.read_bytes())
        read_photographs(path.parent)
    finally:
        place.write_bytes(whole)


class Lasting:
    """A child's process for many cases, each with limits of its own."""

    def __init__(self) -> None:
        self._child = Child()

    def __call__(self, *_: object) -> "Lasting":
        return self

    def call(self, decode: Decoder, packages: Any, size: int, **arguments: Any) -> Arrays:
        self._child._size, self._child._taken, self._child._spent = 0, 0, 0.0
        return self._child.call(decode, packages, size, **arguments)


@pytest.fixture
def lasting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let all decoders use one process."""
    child = Lasting()
    for name, module in list(sys.modules.items()):
        if name.startswith("mplicits.readers."):
            for function, other in (("in_child", child.call), ("child_of", child)):
                if hasattr(module, function):
                    monkeypatch.setattr(module, function, other)


def naming(data: bytes, names: list[bytes], random: Random) -> bytes:
    """Let a file name what stands by: in place of a name, as an entity or a document type, or anywhere."""
    name = random.choice(names)
    known = [each for each in NAMES if each in data]
    if known and random.random() < 0.6:
        return data.replace(random.choice(known), name)
    kind = random.choice((b'<!DOCTYPE r SYSTEM "%s">', b'<!DOCTYPE r [<!ENTITY %% p SYSTEM "%s">%%p;]>', b"%s"))
    start = data.find(b"?>") + 2 if b"?>" in data else random.randrange(len(data) + 1)
    end = start + len(kind % name) if random.random() < 0.5 else start
    return data[:start] + kind % name + data[end:]


def spoilt(data: bytes, names: list[bytes], random: Random) -> bytes:
    """Damage a file, or what an archive or E57's pages hold; a third of them name what stands by."""
    if data.startswith(b"ASTM-E57") and random.random() < 0.8:
        content = without_checksums(data)
        changed = naming(content, names, random) if random.random() < 0.33 else damaged(content, random)
        return with_checksums(with_lengths(changed, len(changed) - len(content)))
    if data[:2] == b"PK" and random.random() < 0.7:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        chosen = random.choice([*members])
        members[chosen] = spoilt(members[chosen], names, random)
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in members.items():
                archive.writestr(name, content)
        return packed.getvalue()
    return naming(data, names, random) if random.random() < 0.33 else damaged(data, random)


def cases(whole: list[Case], names: list[bytes], count: int, seed: int) -> Iterator[Case]:
    """Make damaged files."""
    random = Random(f"{whole[0][0]} {seed}")
    for number in range(count):
        name, data = random.choice(whole)
        stem, _, ending = name.rpartition(".")
        yield f"format-{stem}-{seed}-{number}.{ending}", spoilt(data, names, random)


def check(kind: str, count: int, seed: int, folder: Path) -> None:
    """Read damaged files of a format, or of COLMAP."""
    (inside := folder / "inside").mkdir()
    use: Callable[[Path], object] = read_shape
    if kind == "colmap":
        whole, use = colmap(inside), use_colmap
    else:
        path = inside / kind
        FORMATS[kind](path)
        whole = [(path.name, path.read_bytes())]
        read_shape(path)
    with standby(folder / "secret.obj") as guard:
        found = survive(cases(whole, guard.names(), count, seed), use, inside, CASES)
        assert found + guard.contacts() == [], f"seed {seed}"


@pytest.mark.usefixtures("lasting")
@pytest.mark.parametrize("kind", [*FORMATS, "colmap"])
def test_damage_ends_in_one_line_and_contacts_nothing(kind: str, tmp_path: Path) -> None:
    check(kind, FAST, 0, tmp_path)


@pytest.mark.slow
@pytest.mark.usefixtures("lasting")
@pytest.mark.parametrize("kind", [*FORMATS, "colmap"])
def test_fresh_damage_ends_in_one_line_and_contacts_nothing(kind: str, tmp_path: Path) -> None:
    seed = fresh_seed()
    check(kind, MANY, seed, tmp_path)


def test_a_contact_is_seen(tmp_path: Path) -> None:
    with standby(tmp_path / "secret.obj") as guard:
        assert guard.contacts() == []
        guard.secret.read_bytes()
        socket.create_connection(guard.server.getsockname()).close()
        assert guard.contacts() == ["the server", "the file"]
