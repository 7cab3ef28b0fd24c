"""Neural normal mapping: the normal of each pixel is the reference's gradient, on a traced level and on a mesh."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mplicits import cli
from mplicits.codegen.targets.glsl330 import bake
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.mesher.extract import extract_model
from mplicits.mesher.write import to_bytes
from mplicits.model.errors import UserError
from mplicits.model.model import Model
from mplicits.model.model_file import save
from mplicits.viewer.draw import tiles
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.rasterizer import Rasterizer
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.triangles import Triangles, read_triangles
from support.fitted_model import fitted_model
from support.triangle_meshes import SQUARE

SIZE = (48, 40)
CAMERA = Camera(40, -25, 3.0)
DATA, NORMAL = RenderOptions(shade="data"), RenderOptions(shade="normal")


@pytest.fixture(scope="module")
def model() -> Model:
    return fitted_model()


@pytest.fixture(scope="module")
def traced(osmesa: Context, model: Model) -> Iterator[Renderer]:
    renderer = Renderer(osmesa, bake(model))
    yield renderer
    renderer.release()


@pytest.fixture(scope="module")
def low_poly(model: Model) -> Triangles:
    """The model's surface by marching cubes on a coarse grid, with its own normals."""
    mesh = extract_model(model, 24).mesh
    assert mesh.normals is not None
    return Triangles(mesh.vertices, mesh.normals, mesh.faces.astype(np.int32))


@pytest.fixture(scope="module")
def rasterizer(osmesa: Context, model: Model, low_poly: Triangles) -> Iterator[Rasterizer]:
    rasterizer = Rasterizer(osmesa, model, low_poly)
    yield rasterizer
    rasterizer.release()


def decoded(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the normals (H, W, 3) of a picture of the shading "normal"."""
    return 2 * image[..., :3] - 1


def points(data: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the end points of the rays of a "data" picture, model space (H, W, 3), and which of them hit, (H, W)."""
    eye, directions, _ = CAMERA.rays(data.shape[1], data.shape[0])
    return (eye + data[..., :1] * directions).astype(np.float32), data[..., 3] == 1


@pytest.mark.parametrize(("level", "normal_level"), [(1, 1), (1, 2), (2, 1), (2, 2)])
def test_normals_of_a_traced_level_match_the_reference(
    traced: Renderer, model: Model, level: int, normal_level: int
) -> None:
    options = RenderOptions(level=level, normal_level=normal_level, shade="normal")
    p, hit = points(traced.render(SIZE, CAMERA, replace(options, shade="data")))
    gradient, _ = interpret.field_gradient(lower(model), p[hit], normal_level)
    expected = gradient / np.linalg.norm(gradient, axis=1)[:, None]
    assert 500 < hit.sum() < 1500
    np.testing.assert_allclose(decoded(traced.render(SIZE, CAMERA, options))[hit], expected, atol=2e-4)


def test_normal_mapping_takes_no_further_steps(traced: Renderer) -> None:
    pictures = [traced.render(SIZE, CAMERA, replace(DATA, level=1, normal_level=level)) for level in (1, 2)]
    np.testing.assert_array_equal(pictures[0], pictures[1])


def test_a_split_picture_is_both_pictures_side_by_side(traced: Renderer) -> None:
    options = RenderOptions(level=1, normal_level=2, shade="normal", split_at=0.5)
    half = traced.render(SIZE, CAMERA, options)
    own, neural = (traced.render(SIZE, CAMERA, replace(NORMAL, level=1, normal_level=level)) for level in (1, 2))
    assert np.abs(own - neural).max() > 0.05
    np.testing.assert_array_equal(half[:, :24], own[:, :24])
    np.testing.assert_array_equal(half[:, 24:], neural[:, 24:])


@pytest.mark.parametrize("level", [1, 2])
def test_normals_of_a_mesh_match_the_reference(rasterizer: Rasterizer, model: Model, level: int) -> None:
    p, hit = points(rasterizer.render(SIZE, CAMERA, DATA))
    gradient, _ = interpret.field_gradient(lower(model), p[hit], level)
    assert 500 < hit.sum() < 1500
    assert np.abs(interpret.field(lower(model), p[hit], 2)).max() < 0.05, "fragments lie where the mesh is"
    image = decoded(rasterizer.render(SIZE, CAMERA, replace(NORMAL, normal_level=level)))[hit]
    np.testing.assert_allclose(image, gradient / np.linalg.norm(gradient, axis=1)[:, None], atol=2e-4)


def test_the_mesh_is_where_the_traced_surface_is(rasterizer: Rasterizer, traced: Renderer) -> None:
    mesh, ray = (renderer.render((160, 160), CAMERA, DATA) for renderer in (rasterizer, traced))
    both, either = (mesh[..., 3] * ray[..., 3]).sum(), np.maximum(mesh[..., 3], ray[..., 3]).sum()
    assert both / either > 0.97
    inside = (mesh[..., 3] * ray[..., 3]) == 1
    assert np.quantile(np.abs(mesh - ray)[inside, 0], 0.95) < 0.02


def test_the_nearest_triangle_wins_in_either_order_and_a_split_shows_own_normals(osmesa: Context, model: Model) -> None:
    behind = SQUARE.vertices - np.array((0, 0, 0.3), np.float32)
    far = Triangles(behind, np.tile(np.array((1, 0, 0), np.float32), (4, 1)), SQUARE.faces)
    pictures = []
    for one, other in ((SQUARE, far), (far, SQUARE)):
        both = Triangles(
            np.concatenate([one.vertices, other.vertices]),
            np.concatenate([one.normals, other.normals]),
            np.concatenate([one.faces, other.faces + 4]),
        )
        rasterizer = Rasterizer(osmesa, model, both)
        pictures.append(rasterizer.render(SIZE, Camera(0, 0), replace(NORMAL, split_at=1.0)))
        halves = decoded(rasterizer.render(SIZE, Camera(0, 0), replace(NORMAL, split_at=0.5)))
        hit = rasterizer.render(SIZE, Camera(0, 0), DATA)[..., 3] == 1
        rasterizer.release()
    np.testing.assert_array_equal(pictures[0], pictures[1])
    np.testing.assert_allclose(decoded(pictures[0])[20, 24], (0, 0, 1), atol=1e-6)
    np.testing.assert_allclose(halves[:, :24][hit[:, :24]] - (0, 0, 1), 0, atol=1e-6)
    assert np.abs(halves[:, 24:][hit[:, 24:]] - (0, 0, 1)).max() > 0.1


def test_background_and_tiles_match_a_traced_picture(
    rasterizer: Rasterizer, traced: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = RenderOptions(samples=2, background=((0.1, 0.2, 0.9), (0.8, 0.1, 0.1)))
    mesh, ray = rasterizer.render(SIZE, CAMERA, options), traced.render(SIZE, CAMERA, options)
    empty = np.maximum(mesh[..., 3], ray[..., 3]) == 0
    assert empty.mean() > 0.3
    np.testing.assert_allclose(mesh[empty], ray[empty], atol=1e-6)
    monkeypatch.setattr(tiles, "TILE_SIDE", 17)
    np.testing.assert_allclose(rasterizer.render(SIZE, CAMERA, options), mesh, atol=1e-4)


def test_a_rasterizer_does_not_affect_the_next_picture(rasterizer: Rasterizer, traced: Renderer) -> None:
    before = traced.render(SIZE, CAMERA)
    rasterizer.render(SIZE, CAMERA, RenderOptions(normal_level=1, split_at=0.5))
    np.testing.assert_array_equal(traced.render(SIZE, CAMERA), before)
    with pytest.raises(UserError, match="levels 1 to 2"):
        rasterizer.render(SIZE, CAMERA, RenderOptions(normal_level=3))


@pytest.mark.usefixtures("osmesa")
@pytest.mark.parametrize("space", ["input", "model"])
def test_render_takes_a_mesh_of_either_space(
    space: str, model: Model, low_poly: Triangles, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    moved = replace(model, center=(7.0, -3.0, 2.0), scale=40.0)
    save(moved, tmp_path / "m.safetensors")
    mesh = extract_model(model, 24).mesh
    place = ((0.0, 0.0, 0.0), 1.0) if space == "model" else (moved.center, moved.scale)
    (tmp_path / "low.ply").write_bytes(to_bytes(mesh, ".ply", *place))
    np.testing.assert_allclose(read_triangles(tmp_path / "low.ply", *place).vertices, low_poly.vertices, atol=1e-5)
    files = [str(tmp_path / "m.safetensors"), "-o", str(tmp_path / "a.png"), "--mesh", str(tmp_path / "low.ply")]
    argv = ["render", *files, "--size", "32", "--json", "--context", "osmesa", "--split"]
    assert cli.main([*argv, "--space", "model"] if space == "model" else argv) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["mesh"], report["level"], report["normal_level"]) == (str(tmp_path / "low.ply"), None, 2)
    assert 0.2 < report["coverage"] < 0.7
    assert Image.open(tmp_path / "a.png").size == (32, 32)


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["--mesh", "none.ply"], "none.ply: no such file"),
        (["--mesh", "none.ply", "--level", "1"], "--level: --mesh traces no rays"),
        (["--mesh", "none.ply", "--shade", "steps", "--rounds", "3"], "--rounds: --mesh traces no rays"),
        (["--mesh", "none.ply", "--normal-level", "3"], "levels 1 to 2"),
        (["--space", "model"], "it needs --mesh"),
        (["--split", "--level", "2"], "another --level"),
    ],
)
def test_bad_arguments_of_meshes_are_one_line(
    argv: list[str],
    said: str,
    model: Model,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    save(model, tmp_path / "m.safetensors")
    assert cli.main(["render", "m.safetensors", *argv]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["m.safetensors"]
