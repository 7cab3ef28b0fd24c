"""Colors from images: sampling, training, and bad images."""

import struct
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import trimesh
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import map_coordinates

from mplicits import cli
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model import quantize
from mplicits.readers.paint import Picture
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Doubles
from mplicits.trainer.texture import TextureStep, initial_texture
from mplicits.trainer.training_samples import Pool
from support.ball_training import SMALL_SETTINGS, train

SIDE = 64


def ramp() -> NDArray[np.uint8]:
    """Make an image whose red grows with u and green with v; blue is 40."""
    at = np.round((np.arange(SIDE) + 0.5) / SIDE * 255)
    red, green = np.meshgrid(at, at[::-1])
    return np.stack([red, green, np.full_like(red, 40)], axis=-1).astype(np.uint8)


def write_ball(folder: Path, name: str = "ball.obj", flipped: bool = False) -> Path:
    """Write a ball with an image, so that its color depends on x and y."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    uv = 0.5 + 0.4 * np.asarray(ball.vertices)[:, :2]
    picture = Image.fromarray(ramp())
    materials: Any = trimesh.visual.material
    glb = name.endswith(".glb")  # a SimpleMaterial would be written with a dark factor
    material = materials.PBRMaterial(baseColorTexture=picture) if glb else materials.SimpleMaterial(image=picture)
    ball.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)  # type: ignore[no-untyped-call]
    if flipped:
        ball.invert()
    ball.export(folder / name)
    return folder / name


def expected(points: Doubles) -> Doubles:
    """Compute the colors of `write_ball` at points of its surface."""
    return np.stack([*(0.5 + 0.4 * points[:, :2]).T, np.full(len(points), 40 / 255)], axis=1)


def test_images_are_filtered_as_in_opengl() -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (5, 7, 3)).astype(np.uint8)
    uv = rng.uniform(-1.5, 2.5, (400, 2))
    colors = Picture(image).at(uv)
    at = np.stack([(1 - uv[:, 1]) * 5 - 0.5, uv[:, 0] * 7 - 0.5])
    theirs = [map_coordinates(image[..., c].astype(float), at, order=1, mode="grid-wrap") for c in range(3)]
    np.testing.assert_allclose(colors, np.stack(theirs, axis=1) / 255, atol=1e-9)


@pytest.mark.parametrize("name", ["ball.obj", "ball.glb"])
@pytest.mark.parametrize("flipped", [False, True])
def test_colors_come_from_the_image_of_the_material(tmp_path: Path, name: str, flipped: bool) -> None:
    shape, warnings = load_shape(str(write_ball(tmp_path, name, flipped)))
    assert len(warnings) == flipped
    assert shape.colored
    surface = shape.surface(2000, np.random.default_rng(0), colors=True)
    assert surface.colors is not None
    assert np.abs(surface.colors - expected(surface.points)).max() < 0.01


def test_the_texture_option_names_an_image(tmp_path: Path) -> None:
    path = write_ball(tmp_path)
    (tmp_path / "material_0.png").unlink()
    shape, warnings = load_shape(str(path))
    assert not shape.colored
    assert "--texture FILE" in warnings[0]
    Image.fromarray(ramp()).convert("RGBA").save(tmp_path / "named.png")
    shape, warnings = load_shape(str(path), tmp_path / "named.png")
    assert (shape.colored, warnings) == (True, [])
    assert shape.source["texture"]["file"] == "named.png"


def test_a_damaged_image_causes_a_warning(tmp_path: Path) -> None:
    path, image = write_ball(tmp_path), tmp_path / "material_0.png"
    data = image.read_bytes()
    for damaged in (b"no picture", data[: len(data) // 2]):
        image.write_bytes(damaged)
        shape, warnings = load_shape(str(path))
        assert not shape.colored
        assert len(warnings) == 1
        assert "no readable image" in warnings[0]


def header(width: int, height: int) -> bytes:
    """Make the beginning of a PNG file that claims this size."""
    chunk = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + chunk + struct.pack(">I", zlib.crc32(chunk))


@pytest.mark.parametrize(
    ("shape", "image", "said"),
    [
        ("ball.obj", "none.png", "no such file"),
        ("ball.obj", "text.png", "not a readable image"),
        ("ball.obj", "short.png", "not a readable image"),
        ("ball.obj", "flat.png", "not a readable image"),
        ("ball.obj", "huge.png", "not a readable image"),
        ("ball.obj", "deep.png", "8 bits a channel"),
        ("ball.obj", "float.tiff", "8 bits a channel"),
        ("plain.stl", "right.png", "no texture coordinates"),
        ("points.npz", "right.png", "a point cloud has no texture coordinates"),
        ("demo", "right.png", "has its own colors"),
    ],
)
def test_an_unusable_image_is_one_line(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    shape: str,
    image: str,
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    write_ball(tmp_path)
    trimesh.creation.icosphere().export("plain.stl")
    np.savez("points.npz", points=np.eye(3), normals=np.eye(3))
    Path("text.png").write_text("no picture")
    Image.fromarray(ramp()).save("right.png")
    Path("short.png").write_bytes(Path("right.png").read_bytes()[:150])
    Path("flat.png").write_bytes(header(8, 0))
    Path("huge.png").write_bytes(header(2**20, 2**20))
    Image.fromarray(np.full((8, 8), 40_000, np.uint16)).save("deep.png")
    Image.fromarray(np.full((8, 8), 0.5, np.float32)).save("float.tiff")
    assert cli.main(["train", shape, "--texture", image, "-o", "m.safetensors", "--quiet"]) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert said in err
    assert not Path("m.safetensors").exists()


def test_packed_networks_are_quantized_and_learn_colors(tmp_path: Path) -> None:
    settings = replace(SMALL_SETTINGS, steps=(60, 60, 150), packed=True, texture_network=(20, 1))
    model = train(load_shape(str(write_ball(tmp_path)))[0], settings)
    assert model.texture is not None
    assert model.texture[0].weight.shape == (20, 3)
    assert all(map(quantize.is_quantized, [model.texture, *(level.network for level in model.levels)]))
    points = load_shape(str(tmp_path / "ball.obj"))[0].surface(2000, np.random.default_rng(3)).points
    colors = interpret.color(lower(model), points.astype(np.float32))
    assert np.abs(colors - expected(points)).mean() < 0.1, "rounding lets the gradient through"


@pytest.mark.parametrize(("gradient", "changes"), [((0, 0, 0, 5), False), ((1, 0, 0, 5), True)])
def test_colors_are_constant_along_the_normal_not_in_time(gradient: tuple[float, ...], changes: bool) -> None:
    """The smoothness term is that of the field's gradient in space; its derivative in time does not count."""
    generator = torch.Generator().manual_seed(1)
    points, colors = torch.rand((64, 4), generator=generator), torch.rand((64, 3), generator=generator)
    pool = Pool(
        points, None, None, torch.zeros(64), torch.tensor([gradient], dtype=torch.float32).repeat(64, 1), colors
    )
    weights = initial_texture((8, 1), 5.0, 0, torch.device("cpu"), moving=True)
    for weight in weights:
        weight.grad = torch.zeros_like(weight)
    step = TextureStep(pool, pool, generator)
    step(weights)
    assert bool(step.terms["along"] > 0) is changes
