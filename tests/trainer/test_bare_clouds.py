"""Point clouds without normals, and Gaussian splats: normals are estimated and point outwards."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from mplicits.model.errors import UserError
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.orient import estimated_normals
from mplicits.trainer.shapes.shape import Doubles, unit

CENTER = np.array((3.0, -2.0, 5.0))


def on_ball(count: int = 3000) -> tuple[Doubles, Doubles]:
    normals = unit(np.random.default_rng(0).normal(size=(count, 3)))
    return CENTER + 2 * normals, normals


def write_ply(path: Path, columns: dict[str, Doubles]) -> None:
    head = ["ply", "format ascii 1.0", f"element vertex {len(columns['x'])}"]
    kinds = {name: "uchar" if name in {"red", "green", "blue"} else "float" for name in columns}
    lines = [*head, *(f"property {kind} {name}" for name, kind in kinds.items()), "end_header"]
    path.write_text("\n".join(lines) + "\n")
    with path.open("ab") as file:
        np.savetxt(file, np.stack(list(columns.values()), axis=1), "%.9g")


def write(path: Path, points: Doubles, colors: Doubles) -> None:
    """Write points with colors in [0, 1], in the format of the ending."""
    if path.suffix == ".npz":
        np.savez(path, points=points, colors=colors)
    elif path.suffix == ".xyz":
        np.savetxt(path, np.concatenate((points, colors * 255), axis=1))
    elif path.suffix == ".obj":
        path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points))
    else:
        names = ("x", "y", "z", "red", "green", "blue")
        write_ply(path, dict(zip(names, np.concatenate((points, np.round(colors * 255)), axis=1).T, strict=True)))


@pytest.mark.parametrize("ending", ["ply", "xyz", "npz", "obj"])
def test_a_ball_without_normals_is_a_ball(tmp_path: Path, ending: str) -> None:
    points, normals = on_ball()
    path = tmp_path / f"ball.{ending}"
    write(path, points, normals / 2 + 0.5)
    shape, warnings = load_shape(str(path), noise=0.0)
    assert warnings == [
        f"ball.{ending}: no normals; estimated, and oriented outwards in one component: check the result"
    ]
    assert shape.source["normals"] == "estimated"
    probes = np.random.default_rng(1).uniform(-1, 1, (1000, 3))
    exact = np.linalg.norm(probes, axis=1) - 1
    distance = shape.distance(probes)
    known = ~np.isnan(distance)
    assert known.mean() > 0.9
    assert (np.sign(distance[known]) == np.sign(exact[known])).mean() > 0.99
    assert np.abs(distance - exact)[known & (np.abs(exact) > 0.1)].max() < 0.02
    surface = shape.surface(500, np.random.default_rng(2), colors=True)
    assert np.einsum("ij,ij->i", surface.points, surface.normals).min() > 0.98
    assert shape.colored == (ending != "obj")
    if surface.colors is not None:
        assert np.abs(surface.colors - (surface.points / 2 + 0.5)).max() < 0.01


def test_normals_of_two_components_point_outwards() -> None:
    torus = trimesh.creation.torus(1.0, 0.3, 128, 64)
    handle = trimesh.creation.capsule(2.0, 0.2).apply_translation((3.0, 0.0, 0.0))
    both: Any = trimesh.util.concatenate((torus, handle))
    points, face = trimesh.sample.sample_surface(both, 8000, seed=1)
    truth = both.face_normals[face]
    normals, pieces = estimated_normals(np.asarray(points))
    assert pieces == 2
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1)
    assert np.einsum("ij,ij->i", normals, truth).min() > 0.8


def test_opaque_gaussian_splats_become_a_colored_cloud(tmp_path: Path) -> None:
    points, normals = on_ball()
    faint = np.random.default_rng(3).uniform(-9, 9, (500, 3))
    every = np.concatenate((points, faint))
    colors = np.concatenate((normals / 2 + 0.5, np.ones((500, 3))))
    columns = dict(zip("xyz", every.T, strict=True)) | {name: np.zeros(len(every)) for name in ("nx", "ny", "nz")}
    columns |= {f"f_dc_{k}": (colors[:, k] - 0.5) / 0.28209479 for k in range(3)}
    columns["opacity"] = np.repeat((4.0, -3.0), (len(points), len(faint)))
    write_ply(tmp_path / "splats.ply", columns)
    shape, warnings = load_shape(str(tmp_path / "splats.ply"), noise=0.0)
    assert "no normals" in warnings[0]
    assert shape.scale == pytest.approx(2.0, rel=0.01)
    surface = shape.surface(500, np.random.default_rng(2), colors=True)
    assert surface.colors is not None
    assert np.abs(surface.colors - (surface.points / 2 + 0.5)).max() < 0.01


def test_duplicates_and_collinear_points_load(tmp_path: Path) -> None:
    points, _ = on_ball(400)
    np.savez(tmp_path / "twice.npz", points=np.repeat(points, 3, axis=0))
    assert load_shape(str(tmp_path / "twice.npz"))[0].scale == pytest.approx(2.0, rel=0.05)
    np.savez(tmp_path / "line.npz", points=np.linspace(0, 1, 300)[:, None] * np.ones(3))
    load_shape(str(tmp_path / "line.npz"))
    np.savez(tmp_path / "few.npz", points=np.repeat(points[:50], 3, axis=0))
    with pytest.raises(UserError, match="50 points at different places"):
        load_shape(str(tmp_path / "few.npz"))
