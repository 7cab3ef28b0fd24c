"""The names in files of shapes and photographs: nothing outside of the folder is read without --follow."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mplicits import check, cli
from mplicits.capture.folder import read_photographs
from mplicits.model.errors import UserError
from mplicits.model.files import inputs_kept
from mplicits.model.references import OUTSIDE
from mplicits.readers.content import Mesh
from mplicits.readers.read import read_shape
from support.ball_photographs import write_transforms_layout
from support.growing_files import SOLID, TRIANGLE, gltf

PLY = """ply
format ascii 1.0
comment TextureFile {}
element vertex 3
property float x
property float y
property float z
property float u
property float v
element face 1
property list uchar int vertex_indices
end_header
0 0 0 0 0
1 0 0 1 0
0 1 0 0 1
3 0 1 2
"""


@pytest.fixture
def inside(tmp_path: Path) -> Path:
    """A folder for shapes, below one with an image and materials."""
    Image.new("RGB", (4, 4), (200, 100, 50)).save(tmp_path / "out.png")
    (tmp_path / "out.mtl").write_text("newmtl a\nmap_Kd ../out.png\n")
    (tmp_path / "out.bin").write_bytes(np.eye(3, dtype="<f4").tobytes())
    folder = tmp_path / "inside"
    folder.mkdir()
    return folder


def obj_with(library: str, folder: Path) -> Path:
    path = folder / "a.obj"
    path.write_text(f"mtllib {library}\n{TRIANGLE}usemtl a\nf 1/1 2/2 3/3\n")
    return path


def obj_with_image(name: str, folder: Path) -> Path:
    (folder / "a.mtl").write_text(f"newmtl a\nmap_Kd {name}\n")
    return obj_with("a.mtl", folder)


def ply_with_image(name: str, folder: Path) -> Path:
    (folder / "a.ply").write_text(PLY.format(name))
    return folder / "a.ply"


def gltf_with_image(name: str, folder: Path) -> Path:
    attributes = {"POSITION": 0, "TEXCOORD_0": 0}
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    more = {"meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}], "materials": [material]}
    return gltf(folder / "a.gltf", more | {"textures": [{"source": 0}], "images": [{"uri": name}]})


def gltf_with_buffer(name: str, folder: Path) -> Path:
    return gltf(folder / "a.gltf", {"buffers": [{"uri": name, "byteLength": 36}]})


@pytest.mark.parametrize(
    ("write", "name"),
    [(write, "../out.png") for write in (obj_with_image, ply_with_image, gltf_with_image)]
    + [(obj_with, "../out.mtl"), (gltf_with_image, "%2e%2e/out.png"), (gltf_with_image, "link.png")],
)
def test_an_image_elsewhere_is_a_warning_that_names_it(write, name: str, inside: Path) -> None:  # type: ignore[no-untyped-def]
    (inside / "link.png").symlink_to("../out.png")
    path = write(name, inside)
    with inputs_kept() as read:
        mesh = read_shape(path)
    assert isinstance(mesh, Mesh)
    assert mesh.paint is None
    assert any(f"{name.replace('%2e', '.')}: {OUTSIDE}" in line for line in mesh.facts.warnings)
    assert all(Path(file).parent == inside for file in read)
    with inputs_kept() as read:
        followed = read_shape(path, follow=True)
    assert isinstance(followed, Mesh)
    assert followed.paint is not None
    assert followed.facts.warnings == []
    assert (inside / "../out.png").resolve() in {Path(file).resolve() for file in read}


def test_a_path_of_another_machine_is_found_beside_the_file(inside: Path) -> None:
    Image.new("RGB", (4, 4), (200, 100, 50)).save(inside / "Skin.PNG")
    for name in ("C:\\work\\skin.png", "/home/someone/skin.png", "..\\textures\\SKIN.png"):
        mesh = read_shape(obj_with_image(name, inside))
        assert isinstance(mesh, Mesh)
        assert mesh.paint is not None


def test_a_buffer_elsewhere_is_one_line_and_follow_reads_it(inside: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = gltf_with_buffer("../out.bin", inside)
    with pytest.raises(UserError, match=f"a.gltf: its file ../out.bin: {OUTSIDE}"):
        read_shape(path)
    assert isinstance(read_shape(path, follow=True), Mesh)
    assert cli.main(["check", str(path)]) == 2
    assert OUTSIDE in capsys.readouterr().err


def test_check_takes_follow_in_python(inside: Path) -> None:
    path = inside / "a.obj"
    path.write_text("mtllib ../red.mtl\nusemtl a\n" + SOLID)
    (inside.parent / "red.mtl").write_text("newmtl a\nKd 1 0 0\n")
    assert any(OUTSIDE in line for line in check(path).warnings)
    assert check(path, follow=True).warnings == ()


@pytest.mark.parametrize("key", ["file_path", "mask_path"])
def test_photographs_elsewhere_need_follow(key: str, inside: Path) -> None:
    write_transforms_layout(inside / "t", 4, 16)
    path = inside / "t" / "transforms.json"
    content = json.loads(path.read_text())
    name = "../elsewhere.png"
    Image.new("RGB", (16, 16)).save(inside / "elsewhere.png")
    content["frames"][0][key] = name
    path.write_text(json.dumps(content))
    with pytest.raises(UserError, match=rf"frame 0: {name}: {OUTSIDE}"):
        read_photographs(inside / "t")
    assert read_photographs(inside / "t", follow=True)


def test_a_linked_photograph_needs_follow(inside: Path) -> None:
    write_transforms_layout(inside / "t", 4, 16)
    picture = next((inside / "t").rglob("*.png"))
    picture.rename(inside / "away.png")
    picture.symlink_to(inside / "away.png")
    with pytest.raises(UserError, match=OUTSIDE):
        read_photographs(inside / "t")
    assert read_photographs(inside / "t", follow=True)


@pytest.mark.parametrize("digits", [400, 5000])
def test_huge_numbers_of_cameras_are_one_line(digits: int, tmp_path: Path) -> None:
    write_transforms_layout(tmp_path / "t", 3, 16)
    path = tmp_path / "t" / "transforms.json"
    content = json.loads(path.read_text())
    content["frames"][1]["transform_matrix"][0][3] = "HUGE"
    path.write_text(json.dumps(content).replace('"HUGE"', "9" * digits))
    with pytest.raises(UserError) as refused:
        read_photographs(tmp_path / "t")
    assert len(str(refused.value)) < 300
