"""Damaged files end in a shape, or in one line that says what is wrong; never in a raw error or a long wait."""

from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from support.fuzzing import damaged
from support.studio_files import Files, Reader, shape_reader

if TYPE_CHECKING:
    from playwright.sync_api import Browser

FEW, MANY, AT_ONCE = 300, 10_000, 100
LONGEST = 100
"""Time of a call, in million sines: some 15 ms each, and more on a busy machine."""
POLYGON = " ".join(str(k) for k in range(1, 900))
HOSTILE: dict[str, Files] = {
    "many counts": {
        "a.ply": b"ply\nformat ascii 1.0\nelement vertex 900000000\nproperty float x\nproperty float y\n"
        b"property float z\nend_header\n0 0 0\n"
    },
    "a long list": {
        "a.ply": b"ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint uchar vertex_indices\n"
        b"end_header\n\xff\xff\xff\xff\0\0"
    },
    "zigzags": {
        "a.obj": ("".join(f"v {k % 7} {(k * k) % 11} {k % 3}\n" for k in range(900)) + f"f {POLYGON}\n" * 400).encode()
    },
    "a loop of nodes": {"a.gltf": b'{"scenes": [{"nodes": [0]}], "nodes": [{"children": [1]}, {"children": [0]}]}'},
    "a deep tree": {
        "a.gltf": (
            '{"scenes": [{"nodes": [0]}], "nodes": ['
            + ",".join(f'{{"children": [{k + 1}]}}' for k in range(100_000))
            + ",{}]}"
        ).encode()
    },
    "many points from nothing": {
        "a.gltf": b'{"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": '
        b'[{"attributes": {"POSITION": 0}}]}], "accessors": [{"type": "VEC3", "componentType": 5126, '
        b'"count": 4000000000}]}'
    },
    "many instances of much": {
        "a.gltf": (
            '{"scenes": [{"nodes": ['
            + ",".join(map(str, range(20_000)))
            + ']}], "nodes": ['
            + ",".join(['{"mesh": 0}'] * 20_000)
            + '], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "accessors": [{"type": "VEC3", '
            '"componentType": 5126, "count": 60000}]}'
        ).encode()
    },
    "many options": {"a.obj": b"mtllib a.mtl\n", "a.mtl": b"newmtl a\nmap_Kd " + b"-o 1 " * 100_000 + b"x"},
    "a long word": {"a.obj": b"v " + b"1" * 3_000_000 + b" 0 0\n"},
    "nothing": {"a.glb": b"", "a.obj": b"", "a.stl": b"", "a.ply": b"", "a.xyz": b""},
}


@pytest.fixture(scope="module")
def read(browser: "Browser") -> Iterator[Reader]:
    with shape_reader(browser) as reader:
        yield reader


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> list[Files]:
    """Small shapes in every format, with what belongs to them."""
    folder = tmp_path_factory.mktemp("whole")
    mesh = trimesh.creation.icosphere(1)
    image = Image.fromarray(np.random.default_rng(0).integers(0, 255, (8, 8, 3), np.uint8))
    colored = mesh.copy()
    colored.visual.vertex_colors = np.uint8(127 + 127 * mesh.vertices)
    textured = mesh.copy()
    visual: Any = trimesh.visual
    material = visual.material.PBRMaterial(baseColorTexture=image)
    textured.visual = visual.TextureVisuals(uv=mesh.vertices[:, :2], material=material)
    for name, made in (("plain", mesh), ("colored", colored), ("textured", textured)):
        for ending in ("obj", "glb", "gltf", "ply", "stl"):
            (folder / name / ending).mkdir(parents=True)
            made.export(folder / name / ending / f"a.{ending}")
    for name in ("plain", "colored"):
        (folder / name / "ascii").mkdir()
        (mesh if name == "plain" else colored).export(folder / name / "ascii" / "a.ply", encoding="ascii")
    (folder / "text").mkdir()
    mesh.export(folder / "text" / "a.stl", file_type="stl_ascii")
    points = trimesh.creation.icosphere(2).vertices
    (folder / "cloud").mkdir()
    np.savetxt(folder / "cloud" / "a.xyz", np.hstack((points, points, 127 + 127 * points)), "%.5f")
    return [_files(path) for path in sorted(folder.rglob("*")) if path.is_dir() and _files(path)]


def _files(folder: Path) -> Files:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def mutations(whole: list[Files], count: int, seed: int) -> Iterator[list[Files]]:
    """Yield lists of files of which one or more are damaged."""
    random = Random(seed)
    for start in range(0, count, AT_ONCE):
        cases: list[Files] = []
        for _ in range(min(AT_ONCE, count - start)):
            files = dict(random.choice(whole))
            for path in random.sample(sorted(files), random.randint(1, len(files))):
                files[path] = damaged(files[path], random)
            cases.append(files)
        yield cases


def attempt(read: Reader, whole: list[Files], count: int, seed: int) -> None:
    for cases in mutations(whole, count, seed):
        wrong, longest = read.attempt(cases)
        assert not wrong, [(cases[place], what) for place, what in wrong][:1]
        assert longest < LONGEST


def test_whole_files_are_read(read: Reader, whole: list[Files]) -> None:
    assert len(whole) == 19
    for files in whole:
        assert "refused" not in read(files), sorted(files)


def test_damaged_files_are_read_or_refused(read: Reader, whole: list[Files]) -> None:
    attempt(read, whole, FEW, 0)


@pytest.mark.slow
def test_many_damaged_files_are_read_or_refused(read: Reader, whole: list[Files]) -> None:
    attempt(read, whole, MANY, 1)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused_soon(name: str, read: Reader) -> None:
    wrong, longest = read.attempt([HOSTILE[name]])
    assert not wrong
    assert longest < 3 * LONGEST  # they go to the limits of what is read
