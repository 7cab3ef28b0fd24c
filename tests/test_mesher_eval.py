"""`mplicits eval`: a model or a mesh against the true surface."""

import json
from dataclasses import asdict, fields, replace
from pathlib import Path

import igl
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

import mplicits
from codegen.model import load, save
from mesher.evaluate import Figures, compare
from mesher.surface import Mesh
from mesher.truth import read
from trainer.demo import signed_distance

DEMO = Path(__file__).parent / "data" / "demo.safetensors"
RADIUS, GAP = 0.6, 0.02
BALL = trimesh.creation.icosphere(subdivisions=5, radius=RADIUS)
LARGER = trimesh.creation.icosphere(subdivisions=5, radius=RADIUS + GAP)
ABOUT = {"model", "shape", "renormalised", "extraction"}


def mesh(given: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(given.vertices, np.float32), np.asarray(given.faces, np.int64))


def test_two_concentric_spheres() -> None:
    found = compare(mesh(LARGER), mesh(BALL), samples=40_000)
    assert found.distance_mean == pytest.approx(GAP, rel=0.02)
    assert found.distance_p99 == pytest.approx(GAP, rel=0.02)
    assert found.missed_mean == pytest.approx(GAP, rel=0.02)
    assert found.missed_p99 == pytest.approx(GAP, rel=0.02)
    assert found.hausdorff == pytest.approx(GAP, rel=0.02)
    assert found.normal_angle < 1.5  # the facets of the two are 2.2 degrees apart from one another
    # Each sample's nearest is as far aside as in two samplings of one sphere, and GAP away.
    assert found.chamfer - found.floor == pytest.approx(2 * GAP**2, rel=0.03)
    # Points that are uniform on an area A have their nearest of n at a mean squared distance of A / (pi n).
    assert found.floor == pytest.approx(2 * 4 * RADIUS**2 / 40_000, rel=0.03)
    assert found.to_truth + found.from_truth == pytest.approx(found.chamfer)
    assert found.iou < found.iou_floor < 1
    assert asdict(found.truth) == {"vertices": 10_242, "faces": 20_480, "components": 1, "watertight": True}


def sampled(of: trimesh.Trimesh, to: trimesh.Trimesh, count: int) -> tuple[NDArray[np.float64], ...]:
    """Distance and squared distance to the nearest of as many samples, and angles, by trimesh and brute force."""
    points, faces = trimesh.sample.sample_surface(of, count, seed=1)
    others, _ = trimesh.sample.sample_surface(to, count, seed=2)
    _, distance, nearest = trimesh.proximity.closest_point_naive(to, points)
    squared = ((points[:, None] - others[None]) ** 2).sum(axis=2).min(axis=1)
    cosine = np.einsum("ij,ij->i", of.face_normals[faces], to.face_normals[nearest])
    return distance, squared, np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def test_figures_agree_with_an_independent_computation() -> None:
    """Other samples of the same surfaces, and so other figures, by as much as samples differ."""
    one = trimesh.creation.icosphere(subdivisions=2, radius=0.9)
    one.vertices *= (1.0, 0.7, 0.5)
    other = trimesh.creation.box((1.2, 0.9, 0.6))
    found = compare(mesh(one), mesh(other), samples=1500)
    distance, squared, angle = sampled(one, other, 1500)
    missed, back, _ = sampled(other, one, 1500)
    assert found.distance_mean == pytest.approx(distance.mean(), rel=0.06)
    assert found.distance_p99 == pytest.approx(np.quantile(distance, 0.99), rel=0.06)
    assert found.missed_mean == pytest.approx(missed.mean(), rel=0.06)
    assert found.missed_p99 == pytest.approx(np.quantile(missed, 0.99), rel=0.06)
    assert found.to_truth == pytest.approx(squared.mean(), rel=0.08)
    assert found.from_truth == pytest.approx(back.mean(), rel=0.08)
    assert found.normal_angle == pytest.approx(angle.mean(), rel=0.06)
    corner = np.linalg.norm((0.6, 0.45, 0.3))
    _, from_corner, _ = trimesh.proximity.closest_point_naive(one, other.vertices)
    assert found.hausdorff == pytest.approx(max(distance.max(), missed.max(), from_corner.max()), rel=0.03)
    assert from_corner.max() < corner


def test_the_seed_is_the_samples() -> None:
    first, again = (compare(mesh(LARGER), mesh(BALL), 3000, seed=5) for _ in range(2))
    assert asdict(first) == asdict(again)
    other = compare(mesh(LARGER), mesh(BALL), 3000, seed=6)
    assert other.chamfer != first.chamfer
    assert other.floor != first.floor


def test_the_floor_is_the_truth_s_alone() -> None:
    figures = [compare(mesh(given), mesh(BALL), 3000) for given in (LARGER, trimesh.creation.box())]
    assert figures[0].floor == figures[1].floor
    assert figures[0].iou_floor == figures[1].iou_floor
    assert figures[0].chamfer != figures[1].chamfer


def test_the_truth_itself_reaches_its_floor() -> None:
    found = compare(mesh(BALL), mesh(BALL), 40_000)
    assert found.chamfer == pytest.approx(found.floor, rel=0.03)
    assert found.iou == pytest.approx(found.iou_floor, abs=0.02)
    assert max(found.hausdorff, found.normal_angle) < 1e-6


def run(capsys: pytest.CaptureFixture[str], *argv: str) -> dict[str, object]:
    """What `mplicits eval ARGV --json` prints."""
    assert mplicits.main(["eval", *argv, "--samples", "4000", "--json", "--quiet"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    found = json.loads(out)
    assert isinstance(found, dict)
    return found


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current one, with two spheres in it."""
    monkeypatch.chdir(tmp_path)
    BALL.export("ball.ply")
    LARGER.export("larger.ply")
    return tmp_path


@pytest.fixture(scope="module")
def knot() -> trimesh.Trimesh:
    """The built-in shape, from its formula, on a grid of 90^3."""
    side = 90
    axis = np.linspace(-1.02, 1.02, side)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    vertices, faces, _ = igl.marching_cubes(signed_distance(points), points, side, side, side, 0.0)
    return trimesh.Trimesh(vertices, faces, process=False)


def test_the_demo_s_model_is_near_the_demo_s_shape(
    knot: trimesh.Trimesh, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    moved = replace(load(DEMO), centre=(10.0, -20.0, 5.0), scale=3.0)
    save(moved, folder / "moved.safetensors")
    knot.export("knot.ply")
    trimesh.Trimesh(knot.vertices * 3 + (10, -20, 5), knot.faces, process=False).export("moved.ply")
    said = run(capsys, str(DEMO), "knot.ply", "--resolution", "90")
    assert set(said) == ABOUT | {field.name for field in fields(Figures)}
    assert isinstance(said["extraction"], dict)
    assert said["extraction"] | {"seconds": 0} == {"resolution": 90, "level": 2, "seconds": 0, "spurious": 0}
    assert said["extraction"]["seconds"] > 0
    assert isinstance(said["distance_mean"], float)
    assert 1e-4 < said["distance_mean"] < 0.01
    coarse = run(capsys, str(DEMO), "knot.ply", "--resolution", "90", "--level", "1")
    assert isinstance(coarse["distance_mean"], float)
    assert coarse["distance_mean"] > 1.5 * said["distance_mean"]
    there = run(capsys, "moved.safetensors", "moved.ply", "--resolution", "90")
    for name in ("chamfer", "floor", "hausdorff", "distance_mean", "normal_angle"):
        assert there[name] == pytest.approx(said[name], rel=1e-3), name


def test_every_key_is_documented() -> None:
    assert Figures.__doc__ is not None
    assert not [field.name for field in fields(Figures)
                if field.name not in Figures.__doc__ and field.name not in ("reconstruction", "truth")]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".glb", ".STL"])
def test_meshes_of_every_format(suffix: str, capsys: pytest.CaptureFixture[str]) -> None:
    LARGER.export(f"found{suffix}", file_type=suffix[1:].lower())
    said = run(capsys, f"found{suffix}", "ball.ply")
    assert said["distance_mean"] == pytest.approx(GAP / RADIUS, rel=0.02)  # in the truth's unit sphere
    assert said["extraction"] is None
    assert said["reconstruction"] == {"vertices": 10_242, "faces": 20_480, "components": 1, "watertight": True}


@pytest.mark.usefixtures("folder")
def test_inside_out_is_turned(capsys: pytest.CaptureFixture[str]) -> None:
    trimesh.Trimesh(LARGER.vertices, LARGER.faces[:, ::-1], process=False).export("turned.ply")
    angle = run(capsys, "turned.ply", "ball.ply")["normal_angle"]
    assert isinstance(angle, float)
    assert angle < 1.5


@pytest.mark.usefixtures("folder")
def test_renormalising_takes_place_and_size_away(capsys: pytest.CaptureFixture[str]) -> None:
    trimesh.Trimesh(BALL.vertices * 2 + 1, BALL.faces, process=False).export("elsewhere.ply")
    argv = ["eval", "elsewhere.ply", "ball.ply", "--samples", "4000", "--quiet"]
    assert mplicits.main(argv) == 0
    out, err = capsys.readouterr()
    assert err.startswith("warning: elsewhere.ply and ball.ply differ by 1.67 in place or size")
    assert len(err.splitlines()) == 1
    assert "Chamfer, squared, both ways summed" in out
    assert mplicits.main([*argv, "--renormalise", "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["hausdorff"] < 1e-5
    assert json.loads(out)["renormalised"]
    assert not err


def test_renormalising_a_model(folder: Path, knot: trimesh.Trimesh, capsys: pytest.CaptureFixture[str]) -> None:
    trimesh.Trimesh(knot.vertices * 300, knot.faces, process=False).export("far.ply")
    assert mplicits.main(["eval", str(DEMO), "far.ply", "--resolution", "48", "--quiet"]) == 2
    assert "--renormalise" in capsys.readouterr().err
    said = run(capsys, str(DEMO), "far.ply", "--resolution", "90", "--renormalise")
    assert isinstance(said["distance_mean"], float)
    assert said["distance_mean"] < 0.01


@pytest.mark.usefixtures("folder")
def test_people_read_a_table_and_see_a_bar(capsys: pytest.CaptureFixture[str]) -> None:
    assert mplicits.main(["eval", "larger.ply", "ball.ply", "--samples", "4000"]) == 0
    out, err = capsys.readouterr()
    rows = [line.split() for line in out.splitlines()]
    (chamfer,) = (row for row in rows if row[:2] == ["Chamfer,", "squared,"])
    found = json.loads(json.dumps(run(capsys, "larger.ply", "ball.ply")))
    assert [float(number) for number in chamfer[-2:]] == pytest.approx([found["chamfer"], found["floor"]], rel=1e-3)
    assert ["watertight", "yes", "yes"] in rows
    assert "comparing |" in err


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(("argv", "said"), [
    (["nothing.safetensors", "ball.ply"], "nothing.safetensors: no such file"),
    (["nothing.ply", "ball.ply"], "nothing.ply: no such file"),
    (["larger.ply", "nothing.ply"], "nothing.ply: no such file"),
    (["larger.ply", "."], "a folder, not a file"),
    (["larger.ply", "x" * 300], "no such file"),
    (["larger.ply", "picture.png"], "picture.png: no mesh format by that ending"),
    (["picture.png", "ball.ply"], "picture.png: not a model file"),
    (["larger.ply", "picture.ply"], "picture.ply: not a readable PLY file"),
    (["larger.ply", "cloud.ply"], "cloud.ply: no triangles in it"),
    (["larger.ply", "empty.obj"], "empty.obj: no triangles in it"),
    (["larger.ply", "nan.ply"], "nan.ply: vertex coordinates that are not finite"),
    (["nan.ply", "ball.ply"], "nan.ply: vertex coordinates that are not finite"),
    (["larger.ply", "huge.obj"], "huge.obj: vertex coordinates that are not finite"),
    (["larger.ply", "index.ply"], "index.ply: triangles of vertices that are not in it"),
    (["larger.ply", "line.obj"], "line.obj: no triangle has an area"),
    (["larger.ply", "point.obj"], "point.obj: all vertices are one point"),
    (["far.ply", "ball.ply"], "far.ply: far outside the unit sphere"),
    (["larger.ply", "ball.ply", "--samples", "0"], "--samples 0"),
    (["larger.ply", "ball.ply", "--samples", "many"], "--samples"),
    (["larger.ply", "ball.ply", "--seed", "-1"], "--seed -1"),
    (["larger.ply", "ball.ply", "--resolution", "64"], "--resolution: M is a mesh already"),
    (["larger.ply", "ball.ply", "--level", "1"], "--level: M is a mesh already"),
    ([str(DEMO), "ball.ply", "--resolution", "4"], "--resolution 4"),
    ([str(DEMO), "ball.ply", "--level", "3"], "--level 3: the model has levels 1 to 2"),
])
def test_bad_input_is_one_line(argv: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("picture.png", "picture.ply"):
        Path(name).write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64))
    trimesh.PointCloud(BALL.vertices).export("cloud.ply")
    broken = np.array(BALL.vertices)
    broken[3, 1] = np.nan
    trimesh.Trimesh(broken, BALL.faces, process=False).export("nan.ply")
    trimesh.Trimesh(BALL.vertices, [*BALL.faces[:-1], (0, 1, 99_999)], process=False, validate=False).export("index.ply")
    trimesh.Trimesh(BALL.vertices * 1000, BALL.faces, process=False).export("far.ply")
    for name, corners in (("empty", "v 0 0 0\n"), ("huge", "v 0 0 1e200\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
                          ("line", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), ("point", "v 1 1 1\n" * 3 + "f 1 2 3\n")):
        Path(f"{name}.obj").write_text(corners, encoding="utf-8")
    assert mplicits.main(["eval", *argv, "--quiet"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert said in err


def test_vertices_at_one_place_are_one(tmp_path: Path) -> None:
    """As STL stores them; and triangles that collapse so do not open the surface."""
    box = trimesh.creation.box()
    corners = np.concatenate((box.triangles.reshape(-1, 3), [[9, 9, 9]]))
    faces = [*np.arange(36).reshape(-1, 3), (0, 0, 1), (0, 1, 0)]
    trimesh.Trimesh(corners, faces, process=False).export(tmp_path / "soup.ply")
    found = read(tmp_path / "soup.ply").placed((0, 0, 0), 2)
    assert (len(found.vertices), len(found.faces)) == (8, 12)
    assert np.abs(found.vertices).max() == 0.25
    assert compare(found, found, 100).truth.watertight
