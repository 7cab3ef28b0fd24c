"""The kind of a file is recognized by its content."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from safetensors.numpy import save_file

from mplicits.codegen.targets import cuda, glsl300es, glsl330, shadertoy
from mplicits.mesher.surface import Mesh
from mplicits.mesher.write import OPTIONS, to_bytes
from mplicits.model.image_file import png_bytes
from mplicits.model.kinds import GENERATED, MESH, MODEL, PICTURE, is_other
from mplicits.model.model_file import load, save
from mplicits.web import page as webpage
from mplicits.web import tiny_page
from mplicits.web.studio_page import studio
from support.paths import DEMO, ROOT
from support.random_model import random_model

KINDS = (MODEL, MESH, PICTURE, GENERATED)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[Path, object]:
    """Files of each kind, and of none."""
    folder = tmp_path_factory.mktemp("kinds")
    kinds: dict[Path, object] = {}
    save(load(DEMO), folder / "model")
    kinds[folder / "model"] = kinds[DEMO] = MODEL
    (folder / "picture").write_bytes(png_bytes(np.zeros((3, 3, 3), np.uint8), "\N{BALLOON}" * 300))
    kinds[folder / "picture"] = PICTURE
    Image.new("RGB", (3, 3)).save(folder / "photograph", "png")
    kinds[folder / "photograph"] = None
    ball = trimesh.creation.icosphere(1)
    mesh = Mesh(np.asarray(ball.vertices, np.float32), np.asarray(ball.faces))
    for suffix in OPTIONS:
        path = folder / f"mesh{suffix}"
        path.write_bytes(to_bytes(mesh, suffix, (0.0, 0.0, 0.0), 1.0))
        kinds[path] = MESH
    (folder / "ascii.stl").write_text(trimesh.exchange.stl.export_stl_ascii(ball))
    kinds[folder / "ascii.stl"] = MESH
    small = random_model((4, 0))
    for target in (glsl330, glsl300es, shadertoy, cuda, tiny_page, webpage):
        path = folder / target.__name__
        more = {"poster": False} if target is webpage else {}
        path.write_text(target.baked(small, **more).text if hasattr(target, "baked") else target.standalone(small))
        kinds[path] = GENERATED
    (folder / "studio").write_text(studio())
    kinds[folder / "studio"] = GENERATED
    save_file({"x": np.zeros(3, np.float32)}, folder / "other.safetensors", {"format": "pt"})
    (folder / "bytes").write_bytes(bytes(200))
    for path in (
        folder / "other.safetensors",
        folder / "bytes",
        ROOT / "README.md",
        ROOT / "glsl" / "passes" / "main.glsl",
    ):
        kinds[path] = None
    return kinds


def test_each_file_has_exactly_one_kind(files: dict[Path, object]) -> None:
    for path, own in files.items():
        assert path.stat().st_size
        for kind in KINDS:
            assert is_other(path, kind) == (kind is not own), (path.name, kind.name)


def test_empty_and_missing_files_are_of_no_kind(tmp_path: Path) -> None:
    (tmp_path / "empty").touch()
    for kind in KINDS:
        assert not is_other(tmp_path / "empty", kind)
        assert not is_other(tmp_path / "missing", kind)
        assert not is_other(Path("/dev/null"), kind)
